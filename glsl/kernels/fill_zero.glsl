// SPDX-License-Identifier: GPL-3.0-or-later
// Zero a buffer where it is: writing it from the host would move it to slow host memory.
layout(std430, binding = 0) writeonly buffer Values { uint values[]; };
const int EACH = 4;  // numbers of a thread: a group clears BLOCK of addon/streams/compute.py

void main() {
    int threads = int(gl_WorkGroupSize.x), first = group() * threads * EACH + int(gl_LocalInvocationID.x);
    for (int k = 0; k < EACH; k++) {
        if (first + k * threads < count) values[first + k * threads] = 0u;
    }
}
