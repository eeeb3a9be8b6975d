// SPDX-License-Identifier: GPL-3.0-or-later
// The gather radius at every place of a surface: native/src/radius/field.rs. Uses the table radii:
// each side's grid, then their nodes, four a texel.
#include "lib/table.glsl"
#include "lib/sides.glsl"

// No component is chosen by a variable index: a GPU's compiler would keep such vectors in memory.
float node_radius(int at) {
    vec4 four = texelFetch(radii, table_texel(at >> 2), 0);
    vec2 two = (at & 2) == 0 ? four.xy : four.zw;
    return (at & 1) == 0 ? two.x : two.y;
}

float radius_along_x(int at, float share) { return mix(node_radius(at), node_radius(at + 1), share); }

float radius_on(int side, vec3 position) {
    RadiusGrid grid = radius_grid_at(side);
    vec3 at = clamp((position - grid.origin) / grid.cell_size, vec3(0.0), grid.cells);
    ivec3 cells = ivec3(grid.cells), cell = min(ivec3(at), cells - 1);
    vec3 share = at - vec3(cell);
    int row = cells.x + 1, layer = row * (cells.y + 1);
    int first = int(grid.first) + cell.z * layer + cell.y * row + cell.x;
    float near = mix(radius_along_x(first, share.x), radius_along_x(first + row, share.x), share.y);
    first += layer;
    float far = mix(radius_along_x(first, share.x), radius_along_x(first + row, share.x), share.y);
    return mix(near, far, share.z) * radius_scale;
}

float radius_facing(int axis, float cosine, vec3 position) {
    return !(abs(cosine) >= SIDE_COSINE) ? 1.0e30 : radius_on(side_facing(axis, cosine), position);
}

// The smallest of the sides that a surface counts for; 0 for what is no normal.
float radius_at(vec3 position, vec3 normal) {
    float x = radius_facing(0, normal.x, position), y = radius_facing(1, normal.y, position);
    float radius = min(min(x, y), radius_facing(2, normal.z, position));
    return radius < 1.0e30 ? radius : 0.0;
}

// The blur of a disc that is cut goes with its radius, elsewhere with the square. So once radii are SHRUNK times the
// first pass's, after sixteen passes if nothing else is set, cut discs shrink with the fourth root of the passes
// instead of the sixth, but no further than to the cut.
const float SHRUNK = 0.63;

float cut_radius(float radius, vec2 cut) {
    float least = sqrt(min(radius_scale / SHRUNK, 1.0)) * radius;
    return cut == vec2(0.0) ? radius : clamp(1.0 / length(cut), least, radius);
}

// The largest of an axis' sides that a surface within 45 degrees of a normal may count for.
float largest_radius_facing(int axis, float cosine, vec3 position) {
    int side = side_facing(axis, cosine);
    float radius = radius_on(side, position);
    return abs(cosine) < 0.18 ? max(radius, radius_on(side ^ 1, position)) : radius;
}

// No less than radius_at there of any surface within 45 degrees of a normal. Within 15 degrees of an axis
// all of these count for its side; else each counts for one that is within 45 + 54.8 degrees.
float largest_radius_at(vec3 position, vec3 normal) {
    if (abs(normal.x) >= 0.966) return radius_on(normal.x < 0.0 ? 1 : 0, position);
    if (abs(normal.y) >= 0.966) return radius_on(normal.y < 0.0 ? 3 : 2, position);
    if (abs(normal.z) >= 0.966) return radius_on(normal.z < 0.0 ? 5 : 4, position);
    float x = largest_radius_facing(0, normal.x, position), y = largest_radius_facing(1, normal.y, position);
    return max(max(x, y), largest_radius_facing(2, normal.z, position));
}
