// SPDX-License-Identifier: GPL-3.0-or-later
// Exclusive prefix sum within each block of 1024, and each block's total.
layout(std430, binding = 0) buffer Values { uint values[]; };
layout(std430, binding = 1) buffer Sums { uint sums[]; };

const int PER_THREAD = 4;
shared uint partial[256];

void main() {
    int local = int(gl_LocalInvocationID.x);
    int first = (group() * 256 + local) * PER_THREAD;
    uint mine[PER_THREAD];
    uint total = 0u;
    for (int i = 0; i < PER_THREAD; i++) {
        mine[i] = total;
        if (first + i < count) total += values[first + i];
    }
    partial[local] = total;
    barrier();
    // Hillis & Steele 1986: inclusive over the threads.
    for (int step = 1; step < 256; step *= 2) {
        uint before = local >= step ? partial[local - step] : 0u;
        barrier();
        partial[local] += before;
        barrier();
    }
    uint offset = partial[local] - total;
    for (int i = 0; i < PER_THREAD; i++) {
        if (first + i < count) values[first + i] = offset + mine[i];
    }
    if (local == 255) sums[group()] = partial[255];
}
