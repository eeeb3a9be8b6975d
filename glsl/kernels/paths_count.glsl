// SPDX-License-Identifier: GPL-3.0-or-later
// Count the photons that are alive.
#include "lib/compaction.glsl"
#include "lib/under_way.glsl"

void main() {
    uint kept = 0u;
    for (int i = first_element(); i < first_element() + PER_THREAD; i++) kept += is_alive(i) ? 1u : 0u;
    sum_up_to_here(kept);
    if (gl_LocalInvocationID.x == 0u) kept_in_block[group()] = sum_of_group();
}
