// SPDX-License-Identifier: GPL-3.0-or-later
// Move each photon to its place: its cell's start plus its rank by number within the cell, so that
// the order, and with it every sum, is the same each time. Neighbouring threads take photons of the
// same cell, and so read the same list.
#include "lib/table.glsl"
#include "lib/grid.glsl"
layout(std430, binding = 0) readonly buffer Starts { uint starts[]; };
layout(std430, binding = 1) readonly buffer Listed { uint listed[]; };
layout(std430, binding = 2) writeonly buffer Places { vec4 sorted_place[]; };
layout(std430, binding = 3) writeonly buffer Deposits { vec4 sorted_deposit[]; };
layout(std430, binding = 4) readonly buffer Fullest { uint fullest; };
uniform sampler2D place;
uniform sampler2D deposit;
uniform uint most_ranked;  // none where a cell has more

void main() {
    if (thread() >= count || fullest > most_ranked) return;
    int i = int(listed[thread()]);
    vec4 p = texelFetch(place, table_texel(i), 0);
    int cell = cell_of(p);
    uint start = starts[cell], end = starts[cell + 1], rank = 0u;
    for (uint j = start; j < end; j++) rank += listed[j] < uint(i) ? 1u : 0u;
    sorted_place[start + rank] = p;
    sorted_deposit[start + rank] = texelFetch(deposit, table_texel(i), 0);
}
