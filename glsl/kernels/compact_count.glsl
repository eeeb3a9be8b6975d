// SPDX-License-Identifier: GPL-3.0-or-later
// Count the deposits worth keeping.
#include "lib/compaction.glsl"
#include "lib/landed.glsl"
layout(std430, binding = 1) buffer Counts { uint dropped; };  // deposits that are not finite; only grows

void main() {
    for (int i = first_element(); i < first_element() + PER_THREAD; i++) {
        if (has_landed(i) && !is_kept(i)) atomicAdd(dropped, 1u);
    }
    count_block();
}
