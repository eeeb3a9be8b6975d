// SPDX-License-Identifier: GPL-3.0-or-later
// Move each photon to its place: its cell's start plus its rank by number within the cell, so that
// the order, and with it every sum, is the same each time.
#include "lib/table.glsl"
#include "lib/grid.glsl"
layout(std430, binding = 0) readonly buffer Starts { uint starts[]; };
layout(std430, binding = 1) readonly buffer Listed { uint listed[]; };
layout(rgba32f, binding = 0) writeonly uniform image2D sorted_place;
layout(rgba32f, binding = 1) writeonly uniform image2D sorted_deposit;
uniform sampler2D place;
uniform sampler2D deposit;

void main() {
    int i = thread();
    if (i >= count) return;
    vec4 p = texelFetch(place, table_texel(i), 0);
    int cell = cell_of(p.xyz);
    uint start = starts[cell], end = starts[cell + 1], rank = 0u;
    for (uint j = start; j < end; j++) rank += listed[j] < uint(i) ? 1u : 0u;
    ivec2 to = table_texel(int(start + rank));
    imageStore(sorted_place, to, p);
    imageStore(sorted_deposit, to, texelFetch(deposit, table_texel(i), 0));
}
