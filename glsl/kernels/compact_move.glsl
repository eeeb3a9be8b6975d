// SPDX-License-Identifier: GPL-3.0-or-later
// Append the flagged deposits to the photon map, in order, and say where the next append begins.
#include "lib/table.glsl"
layout(std430, binding = 0) readonly buffer Offsets { uint offsets[]; };
layout(std430, binding = 1) buffer Ends { uint ends[]; };  // of each append of a pass
layout(rgba32f, binding = 0) writeonly uniform image2D kept_place;
layout(rgba32f, binding = 1) writeonly uniform image2D kept_deposit;
uniform sampler2D place;
uniform sampler2D deposit;
uniform int append;

void main() {
    int i = thread();
    uint base = append == 0 ? 0u : ends[append - 1];
    if (i == 0) ends[append] = base + offsets[count];
    if (i >= count || offsets[i] == offsets[i + 1]) return;
    int width = textureSize(place, 0).x;
    ivec2 to = table_texel(int(base + offsets[i]));
    imageStore(kept_place, to, texelFetch(place, ivec2(i % width, i / width), 0));
    imageStore(kept_deposit, to, texelFetch(deposit, ivec2(i % width, i / width), 0));
}
