// SPDX-License-Identifier: GPL-3.0-or-later
// Lower radii along an axis, a thread a line, until none exceeds a neighbour's by more than a quarter of the
// way to it: after all three axes, along any path.
#include "lib/radius_grid.glsl"
layout(std430, binding = 0) buffer Radii { float radii[]; };
uniform int axis;

void main() {
    int side = thread() / most_a_side, at, step, length;
    if (thread() >= count) return;
    SideGrid grid = grid_of(side);
    if (!line_in(nodes_of(grid), axis, thread() % most_a_side, at, step, length)) return;
    at += grid.first;
    float steepest = 0.25 * grid.cell_size, radius = radii[at];
    for (int i = 1; i < length; i++) {
        at += step;
        radius = min(radii[at], radius + steepest);
        radii[at] = radius;
    }
    for (int i = 1; i < length; i++) {
        at -= step;
        radius = min(radii[at], radius + steepest);
        radii[at] = radius;
    }
}
