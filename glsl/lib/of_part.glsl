// SPDX-License-Identifier: GPL-3.0-or-later
// Whole numbers from 1 to 2^24, of either sign, that tell too which part of a stream they are of: by a power of two, so
// that nothing is rounded. Of the first part they are what they are. Parts take turns with larger powers and with smaller
// ones, of which float32 has room for eight.
const int DIGITS_OF_PART = 25;

int turn_of_part(int part) { return (part & 1) == 0 ? -(part >> 1) : (part + 1) >> 1; }
float power_of_turn(int turn) { return uintBitsToFloat(uint(127 + DIGITS_OF_PART * turn) << 23u); }
int turn_of(float number) {
    return (int(floatBitsToUint(number) >> 23u & 255u) + 4 * DIGITS_OF_PART - 127) / DIGITS_OF_PART - 4;
}

float of_part(float number, int part) { return number * power_of_turn(turn_of_part(part)); }
float without_part(float number) { return number * power_of_turn(-turn_of(number)); }
int part_in(float number) {
    int turn = turn_of(number);
    return turn > 0 ? 2 * turn - 1 : -2 * turn;
}
