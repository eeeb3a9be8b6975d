// SPDX-License-Identifier: GPL-3.0-or-later
// As radius_flatten, along x.
#include "lib/radius_rows.glsl"
layout(std430, binding = 0) buffer Radii { float radii[]; };
shared float firsts[gl_WorkGroupSize.x];
shared float lasts[gl_WorkGroupSize.x];
const float NONE = 1.0e30;

void main() {
    int line = thread() / THREADS, side = min(line / most_a_side, 5), part = int(gl_LocalInvocationID.x);
    RadiusGrid grid = grid_of(side);
    Share share = share_of(nodes_of(grid), line % most_a_side, first_node(grid));
    float steepest = 0.25 * grid.cell_size, some[MOST_A_THREAD];
    for (int k = 0; k < MOST_A_THREAD; k++) some[k] = k < share.here ? radii[share.at + share.first + k] : NONE;
    for (int k = 1; k < MOST_A_THREAD; k++) some[k] = min(some[k], some[k - 1] + steepest);
    for (int k = MOST_A_THREAD - 2; k >= 0; k--) some[k] = min(some[k], some[k + 1] + steepest);
    firsts[part] = lasts[part] = some[0];
    for (int k = 1; k < MOST_A_THREAD; k++) {
        if (k < share.here) lasts[part] = some[k];
    }
    barrier();
    // What its neighbours allow at its first and at its last; threads after it may have none or fewer.
    float low = NONE, high = NONE;
    for (int i = 1; i <= share.own; i++) {
        low = min(low, lasts[part - i] + steepest * float((i - 1) * share.each + 1));
    }
    for (int i = 1; i < THREADS - share.own; i++) {
        high = min(high, firsts[part + i] + steepest * float((i - 1) * share.each + 1));
    }
    for (int k = 0; k < MOST_A_THREAD; k++) {
        float around = min(low + steepest * float(k), high + steepest * float(share.here - 1 - k));
        if (k < share.here) radii[share.at + share.first + k] = min(some[k], around);
    }
}
