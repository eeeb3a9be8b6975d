// SPDX-License-Identifier: GPL-3.0-or-later
// Lower radii along an axis, a thread a line, until none exceeds a neighbour's by more than a quarter of the
// way to it: after all three axes, along any path.
#include "lib/radius_grid.glsl"
layout(std430, binding = 0) buffer Radii { float radii[]; };
uniform int axis;

// From one end of a line to the other.
void sweep(int at, int step, int length, float steepest) {
    float radius = 1.0e30, some[AT_ONCE];
    for (int done = 0; done < length; done += AT_ONCE, at += AT_ONCE * step) {
        for (int k = 0; k < AT_ONCE; k++) some[k] = done + k < length ? radii[at + k * step] : 0.0;
        for (int k = 0; k < AT_ONCE; k++) {
            radius = min(some[k], radius + steepest);
            if (done + k < length) radii[at + k * step] = radius;
        }
    }
}

void main() {
    int side = thread() / most_a_side, at, step, length;
    if (thread() >= count) return;
    RadiusGrid grid = grid_of(side);
    if (!line_in(nodes_of(grid), axis, thread() % most_a_side, at, step, length)) return;
    at += first_node(grid);
    sweep(at, step, length, 0.25 * grid.cell_size);
    sweep(at + (length - 1) * step, -step, length, 0.25 * grid.cell_size);
}
