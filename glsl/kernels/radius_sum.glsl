// SPDX-License-Identifier: GPL-3.0-or-later
// Sum counts along an axis, a thread a line: after all three, photons in the cells below each corner.
#include "lib/radius_grid.glsl"
layout(std430, binding = 0) buffer Sums { uint sums[]; };
uniform int axis;

void main() {
    int side = thread() / most_a_side, at, step, length;
    if (thread() >= count) return;
    if (!line_in(corners_of(grid_of(side)), axis, thread() % most_a_side, at, step, length)) return;
    at += first_corner(side);
    uint sum = 0u;
    for (int i = 0; i < length; i++, at += step) {
        sum += sums[at];
        sums[at] = sum;
    }
}
