// SPDX-License-Identifier: GPL-3.0-or-later
// Four numbers as one value: of each operand the first.
// Operands: x, y, z, w.

vec4 run_combine(vec4 x, vec4 y, vec4 z, vec4 w) { return vec4(x.x, y.x, z.x, w.x); }
