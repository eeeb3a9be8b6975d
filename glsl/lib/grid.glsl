// SPDX-License-Identifier: GPL-3.0-or-later
// Grids of photons, one of each part: cells of cell_size from grid_origin, x fastest, numbered from first_cell on.
#include "lib/of_part.glsl"

uniform vec3 grid_origin;
uniform float cell_size[MOST_PARTS];
uniform ivec3 grid_cells[MOST_PARTS];
uniform int first_cell[MOST_PARTS];

// Of a deposit's place.
int cell_of(vec4 place) {
    int part = part_in(place.w);
    ivec3 cells = grid_cells[part];
    ivec3 c = clamp(ivec3(floor((place.xyz - grid_origin) / cell_size[part])), ivec3(0), cells - 1);
    return first_cell[part] + (c.z * cells.y + c.y) * cells.x + c.x;
}
