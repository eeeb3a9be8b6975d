// SPDX-License-Identifier: GPL-3.0-or-later
// What media are at places, of those that differ. Uses the tables of grids and voxels.

// What a grid has at a place, evenly between its own; beyond its faces, what it has there. `first`: of voxels.
vec3 voxel_between(Grid grid, vec3 place, float first) {
    vec3 at = clamp((place - grid.low) * grid.finer, vec3(0.0), grid.count - 1.0);
    vec3 below = min(floor(at), grid.count - 2.0), part = at - below, found = vec3(0.0);
    int layer = int(grid.count.x * grid.count.y), number = int(first + below.x + grid.count.x * below.y);
    number += int(below.z) * layer;
    for (int i = 0; i < int(grid.channels); i++) {
        vec4 both = mix(voxel_at(number).values, voxel_at(number + layer).values, part.z);
        vec2 ends = mix(both.xy, both.zw, part.y);
        found[i] = mix(ends.x, ends.y, part.x);
        number += layer * int(grid.count.z);
    }
    return grid.channels < 2.0 ? found.xxx : found;
}

// What a medium is at a place, whose values are means.
Interior varied(Interior mean, vec3 place) {
    Grid grid = grid_at(int(mean.grid) - 1);
    vec3 lost = voxel_between(grid, place, grid.first), scattered = lost;
    if (grid.first_scattering >= 0.0) scattered = voxel_between(grid, place, grid.first_scattering);
    return Interior(mean.extinction * lost, mean.anisotropy, mean.scattering * scattered, mean.grid);
}
