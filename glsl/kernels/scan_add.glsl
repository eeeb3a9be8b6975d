// SPDX-License-Identifier: GPL-3.0-or-later
// Add to each block of 1024 the sum of the blocks before it.
layout(std430, binding = 0) buffer Values { uint values[]; };
layout(std430, binding = 1) buffer Sums { uint sums[]; };

void main() {
    int i = thread();
    if (i < count) values[i] += sums[i / 1024];
}
