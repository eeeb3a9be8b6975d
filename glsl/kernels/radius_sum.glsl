// SPDX-License-Identifier: GPL-3.0-or-later
// Sum counts along an axis, a thread a line: after all three axes, photons in the cells below each corner.
#include "lib/radius_grid.glsl"
layout(std430, binding = 0) buffer Sums { uint sums[]; };
uniform int axis;

void main() {
    int side = thread() / most_a_side, at, step, length;
    if (thread() >= count) return;
    RadiusGrid grid = grid_of(side);
    if (!line_in(corners_of(grid), axis, thread() % most_a_side, at, step, length)) return;
    at += first_corner(grid);
    uint sum = 0u, some[AT_ONCE];
    for (int done = 0; done < length; done += AT_ONCE, at += AT_ONCE * step) {
        for (int k = 0; k < AT_ONCE; k++) some[k] = done + k < length ? sums[at + k * step] : 0u;
        for (int k = 0; k < AT_ONCE; k++) {
            sum += some[k];
            if (done + k < length) sums[at + k * step] = sum;
        }
    }
}
