// SPDX-License-Identifier: GPL-3.0-or-later
// The grid of photons: cells of cell_size from grid_origin, x fastest.
uniform vec3 grid_origin;
uniform float cell_size;
uniform ivec3 grid_cells;

int cell_of(vec3 position) {
    ivec3 c = clamp(ivec3(floor((position - grid_origin) / cell_size)), ivec3(0), grid_cells - 1);
    return (c.z * grid_cells.y + c.y) * grid_cells.x + c.x;
}
