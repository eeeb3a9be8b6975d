// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of an instruction: rows that lie evenly from 0 to 1, the first and the number of which an operand says.
// As Cycles 5.0 looks up ramps and curves (kernel/svm/ramp.h). Uses the table of constants.

// The row at `at`, or of the straight line between its neighbours if it `interpolates`; beyond the ends the last
// one, or with `extends` the line through the last two.
vec4 row_at(vec4 rows, float at, bool interpolates, bool extends) {
    float steps = rows.y - 1.0;
    float f = at > 0.0 ? min(at, 1.0) * steps : 0.0;  // also of NaN
    float i = min(floor(f), max(steps - 1.0, 0.0));
    if (!interpolates) i = floor(f);
    vec4 row = constant_at(int(rows.x + i)).value;
    if (!interpolates) return row;
    vec4 next = constant_at(int(rows.x + min(i + 1.0, steps))).value;
    if (extends && abs(at - 0.5) > 0.5) f = at * steps;
    return mix(row, next, f - i);
}
