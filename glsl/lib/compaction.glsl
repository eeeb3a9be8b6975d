// SPDX-License-Identifier: GPL-3.0-or-later
// Elements worth keeping move to the front, in order, in two programs: `<stem>_count.glsl` counts them in
// blocks, a work group each, and `<stem>_move.glsl` finds where each goes from the blocks before its own.
#include "lib/group_scan.glsl"
layout(std430, binding = 0) buffer Blocks { uint kept_in_block[]; };

bool is_kept(int i);  // which ones: the including program's; false beyond the last

// Of this thread's elements.
uint kept_here() {
    uint kept = 0u;
    for (int i = first_element(); i < first_element() + PER_THREAD; i++) kept += is_kept(i) ? 1u : 0u;
    return kept;
}

void count_block() {
    sum_up_to_here(kept_here());
    if (gl_LocalInvocationID.x == 0u) kept_in_block[group()] = sum_of_group();
}

uint kept_before_block(int block) {
    uint own = 0u;
    for (int i = int(gl_LocalInvocationID.x); i < block; i += 256) own += kept_in_block[i];
    sum_up_to_here(own);
    return sum_of_group();
}

// Of all elements.
uint kept_in_all() { return kept_before_block((count + 256 * PER_THREAD - 1) / (256 * PER_THREAD)); }

// How many are kept before this thread's elements; sum_of_group() is then the block's.
uint kept_before_here() {
    uint before = kept_before_block(group()), kept = kept_here();
    return before + sum_up_to_here(kept) - kept;
}
