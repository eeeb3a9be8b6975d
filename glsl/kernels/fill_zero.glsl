// SPDX-License-Identifier: GPL-3.0-or-later
// Zero a buffer where it is: writing it from the host would move it to slow host memory.
layout(std430, binding = 0) writeonly buffer Values { uint values[]; };

void main() {
    int i = thread();
    if (i < count) values[i] = 0u;
}
