// SPDX-License-Identifier: GPL-3.0-or-later
// Exclusive prefix sum within each block of 1024, and each block's total.
#include "lib/group_scan.glsl"
layout(std430, binding = 0) buffer Values { uint values[]; };
layout(std430, binding = 1) buffer Sums { uint sums[]; };

void main() {
    int first = first_element();
    uint mine[PER_THREAD];
    uint total = 0u;
    for (int i = 0; i < PER_THREAD; i++) {
        mine[i] = total;
        if (first + i < count) total += values[first + i];
    }
    uint offset = sum_up_to_here(total) - total;
    for (int i = 0; i < PER_THREAD; i++) {
        if (first + i < count) values[first + i] = offset + mine[i];
    }
    if (gl_LocalInvocationID.x == 0u) sums[group()] = sum_of_group();
}
