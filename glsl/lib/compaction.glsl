// SPDX-License-Identifier: GPL-3.0-or-later
// Elements worth keeping move to the front, in order, in two programs: `<stem>_count.glsl` counts them in
// blocks, a work group each, and `<stem>_move.glsl` finds where each goes from the blocks before its own.
const int PER_THREAD = 4;  // elements; consecutive ones, so that ranks are in order
layout(std430, binding = 0) buffer Blocks { uint kept_in_block[]; };
shared uint partial[256];

int first_element() { return (group() * 256 + int(gl_LocalInvocationID.x)) * PER_THREAD; }

// The sum over the threads up to this one (Hillis & Steele 1986).
uint sum_up_to_here(uint own) {
    int local = int(gl_LocalInvocationID.x);
    barrier();  // others may still read the last one
    partial[local] = own;
    barrier();
    for (int step = 1; step < 256; step *= 2) {
        uint before = local >= step ? partial[local - step] : 0u;
        barrier();
        partial[local] += before;
        barrier();
    }
    return partial[local];
}

// The sum over all threads of the group, after sum_up_to_here.
uint sum_of_group() { return partial[255]; }

uint kept_before_block() {
    uint own = 0u;
    for (int i = int(gl_LocalInvocationID.x); i < group(); i += 256) own += kept_in_block[i];
    sum_up_to_here(own);
    return sum_of_group();
}
