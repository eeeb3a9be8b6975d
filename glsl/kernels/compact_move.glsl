// SPDX-License-Identifier: GPL-3.0-or-later
// Append the deposits worth keeping to the photon map, in order, and say where the next append begins.
#include "lib/table.glsl"
#include "lib/compaction.glsl"
#include "lib/landed.glsl"
layout(std430, binding = 1) buffer Counts { uint dropped; uint ends[]; };  // of each append of a pass
layout(rgba32f, binding = 0) writeonly uniform image2D kept_place;
layout(rgba32f, binding = 1) writeonly uniform image2D kept_deposit;
uniform int append;

void main() {
    uint to = kept_before_here() + (append == 0 ? 0u : ends[append - 1]);
    bool is_last = first_element() < count && (group() + 1) * 256 * PER_THREAD >= count;
    // The first thread has nothing of its block before it.
    if (gl_LocalInvocationID.x == 0u && is_last) ends[append] = to + sum_of_group();
    for (int i = first_element(); i < first_element() + PER_THREAD; i++) {
        if (!is_kept(i)) continue;
        imageStore(kept_place, table_texel(int(to)), texelFetch(place, texel_of(i), 0));
        imageStore(kept_deposit, table_texel(int(to)), texelFetch(deposit, texel_of(i), 0));
        to++;
    }
}
