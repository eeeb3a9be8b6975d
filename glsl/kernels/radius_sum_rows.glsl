// SPDX-License-Identifier: GPL-3.0-or-later
// As radius_sum, along x. A line is read and written side by side, by way of shared memory.
#include "lib/radius_rows.glsl"
layout(std430, binding = 0) buffer Sums { uint sums[]; };
shared uint lines[gl_WorkGroupSize.x / THREADS][THREADS * MOST_A_THREAD];
shared uint parts[gl_WorkGroupSize.x];

void main() {
    int line = thread() / THREADS, side = min(line / most_a_side, 5), part = int(gl_LocalInvocationID.x);
    RadiusGrid grid = grid_of(side);
    Share share = share_of(corners_of(grid), line % most_a_side, first_corner(grid));
    int here = part / THREADS;
    for (int i = share.own; i < share.all; i += THREADS) lines[here][i] = sums[share.at + i];
    barrier();
    uint sum = 0u;
    for (int i = share.first; i < share.first + share.here; i++) sum = lines[here][i] += sum;
    parts[part] = sum;
    barrier();
    uint before = 0u;
    for (int i = part - share.own; i < part; i++) before += parts[i];
    for (int i = share.first; i < share.first + share.here; i++) lines[here][i] += before;
    barrier();
    for (int i = share.own; i < share.all; i += THREADS) sums[share.at + i] = lines[here][i];
}
