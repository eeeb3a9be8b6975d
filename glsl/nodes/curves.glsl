// SPDX-License-Identifier: GPL-3.0-or-later
// Each channel by a column of a table of its own, at a number from 0 to 1.
// Operands: at, rows, [extends].
#include "lib/rows.glsl"

vec4 run_curves(vec4 at, vec4 rows, vec4 extends) {
    bool beyond = extends.x > 0.0;
    vec3 result = vec3(
        row_at(rows, at.x, true, beyond).x, row_at(rows, at.y, true, beyond).y, row_at(rows, at.z, true, beyond).z);
    return vec4(result, 1.0);
}
