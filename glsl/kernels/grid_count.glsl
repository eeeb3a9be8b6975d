// SPDX-License-Identifier: GPL-3.0-or-later
// Count the photons of each cell, and the fullest cell's.
#include "lib/table.glsl"
#include "lib/grid.glsl"
layout(std430, binding = 0) buffer Counts { uint counts[]; };
layout(std430, binding = 1) buffer Fullest { uint fullest; };
uniform sampler2D place;

void main() {
    int i = thread();
    if (i >= count) return;
    uint before = atomicAdd(counts[cell_of(texelFetch(place, table_texel(i), 0))], 1u);
    // Few cells are ever that full: the others need not queue for one address.
    if (before >= 255u) atomicMax(fullest, before + 1u);
}
