// SPDX-License-Identifier: GPL-3.0-or-later
// A row of a table, or between two of them: a colour and its alpha at a number from 0 to 1.
// Operands: at, rows, [interpolates] [extends].
#include "lib/rows.glsl"

vec4 run_ramp(vec4 at, vec4 rows, vec4 how) { return row_at(rows, at.x, how.x > 0.0, how.y > 0.0); }
