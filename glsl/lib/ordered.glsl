// SPDX-License-Identifier: GPL-3.0-or-later
// Floats as whole numbers of the same order, for atomics.

uint ordered(float x) {
    uint bits = floatBitsToUint(x);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float of_ordered(uint number) {
    return uintBitsToFloat((number & 0x80000000u) != 0u ? number & 0x7fffffffu : ~number);
}
