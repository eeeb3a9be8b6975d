// SPDX-License-Identifier: GPL-3.0-or-later
// List each cell's photons, in whatever order the threads come; grid_rank puts them right.
// Counts hold the number of photons not yet listed.
#include "lib/table.glsl"
#include "lib/grid.glsl"
layout(std430, binding = 0) buffer Counts { uint counts[]; };
layout(std430, binding = 1) readonly buffer Starts { uint starts[]; };
layout(std430, binding = 2) writeonly buffer Listed { uint listed[]; };
uniform sampler2D place;

void main() {
    int i = thread();
    if (i >= count) return;
    int cell = cell_of(texelFetch(place, table_texel(i), 0));
    listed[starts[cell] + atomicAdd(counts[cell], 0xffffffffu) - 1u] = uint(i);
}
