// SPDX-License-Identifier: GPL-3.0-or-later
// Count photons behind the upper corner of their cell, for each side that they count for.
#include "lib/table.glsl"
#include "lib/packing.glsl"
#include "lib/radius_grid.glsl"
#include "lib/sides.glsl"
layout(std430, binding = 0) buffer Sums { uint sums[]; };
uniform sampler2D place;
uniform sampler2D deposit;

void count_on(int axis, float cosine, vec3 position) {
    if (!(abs(cosine) >= SIDE_COSINE)) return;
    int side = side_facing(axis, cosine);
    RadiusGrid grid = grid_of(side);
    vec3 at = (position - grid.origin) / grid.cell_size;
    if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, grid.cells))) return;
    ivec3 cell = clamp(ivec3((position - grid.origin) / (0.5 * grid.cell_size)), ivec3(0), 2 * ivec3(grid.cells) - 1);
    atomicAdd(sums[first_corner(grid) + index_in(corners_of(grid), cell + 1)], 1u);
}

void main() {
    int i = thread();
    if (i >= count) return;
    vec3 position = texelFetch(place, table_texel(i), 0).xyz;
    vec3 normal = unpack_direction(texelFetch(deposit, table_texel(i), 0).w);
    count_on(0, normal.x, position);
    count_on(1, normal.y, position);
    count_on(2, normal.z, position);
}
