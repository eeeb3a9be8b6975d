// SPDX-License-Identifier: GPL-3.0-or-later
// Count the deposits worth keeping.
#include "lib/compaction.glsl"
#include "lib/landed.glsl"
layout(std430, binding = 1) buffer Counts { uint dropped; };  // deposits that are not finite; only grows

void main() {
    uint kept = 0u;
    for (int i = first_element(); i < first_element() + PER_THREAD; i++) {
        if (is_kept(i)) kept++;
        else if (has_landed(i)) atomicAdd(dropped, 1u);
    }
    sum_up_to_here(kept);
    if (gl_LocalInvocationID.x == 0u) kept_in_block[group()] = sum_of_group();
}
