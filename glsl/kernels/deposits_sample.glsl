// SPDX-License-Identifier: GPL-3.0-or-later
// Every so many-th deposit's position and packed normal.
#include "lib/table.glsl"
layout(std430, binding = 0) writeonly buffer Sample { vec4 some[]; };
uniform sampler2D place;
uniform sampler2D deposit;
uniform int step;

void main() {
    int i = thread();
    if (i >= count) return;
    ivec2 texel = table_texel(i * step);
    some[i] = vec4(texelFetch(place, texel, 0).xyz, texelFetch(deposit, texel, 0).w);
}
