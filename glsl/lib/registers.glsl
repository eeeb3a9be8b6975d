// SPDX-License-Identifier: GPL-3.0-or-later
// Where the interpreter keeps results: PROGRAMS registers are enough. Uses the table of constants, and what
// lib/program.glsl has of parts.

vec4 registers[PROGRAMS];

// What a code stands for: a constant, a register, or a part of one.
vec4 operand(float code) {
    int number = int(code);
    if (number < 0) return constant_at(-1 - number).value;
    number -= 1;
    return part_of(registers[number / PARTS], number % PARTS);
}
