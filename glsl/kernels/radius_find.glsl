// SPDX-License-Identifier: GPL-3.0-or-later
// The radius at a node by the photons in boxes about it: native/src/radius/find.rs, where its reasons are.
#include "lib/constants.glsl"
#include "lib/radius_grid.glsl"
layout(std430, binding = 0) buffer Sums { uint sums[]; };
layout(std430, binding = 1) buffer Radii { float radii[]; };
uniform float photons;  // in a disc
uniform float times;  // photons of a pass for each one counted
uniform float most;  // the widest radius [scene units]
uniform float pixel;  // how wide one is, at distance 1 from the eye or everywhere [scene units]
uniform vec4 eye;  // its fourth number: whether there is one

// As native/src/radius/find.rs, where the reasons stand; AROUND is 2 to the power of AROUND there.
const float BOX = 4.0 / PI;
const float TELLING = 50.0;
const float PASSES = 32.0;
const float UNEVEN = 0.06;
const int AROUND = 4;

// Photons in the box of so many cells to each side of a node.
float photons_about(RadiusGrid grid, int first, ivec3 node, int cells) {
    ivec3 n = corners_of(grid), low = max(2 * node - cells, 0), high = min(2 * node + cells, n - 1);
    uint found = sums[first + index_in(n, high)] - sums[first + index_in(n, ivec3(low.x, high.yz))];
    found -= sums[first + index_in(n, ivec3(high.x, low.y, high.z))] - sums[first + index_in(n, ivec3(low.xy, high.z))];
    found -= sums[first + index_in(n, ivec3(high.xy, low.z))] - sums[first + index_in(n, ivec3(low.x, high.y, low.z))];
    found += sums[first + index_in(n, ivec3(high.x, low.yz))] - sums[first + index_in(n, low)];
    return float(found);
}

// The area of a side's surfaces in such a box, if they fill the box about all photons.
float area_about(int side, RadiusGrid grid, vec3 place, float size, float fine) {
    vec3 length = min(place + size, grid.high) - max(place - size, grid.low);
    length = max(length, vec3(fine));
    return side < 2 ? length.y * length.z : (side < 4 ? length.x * length.z : length.x * length.y);
}

float radius_at(int side, RadiusGrid grid, ivec3 node, vec3 place, float least) {
    int first = first_corner(grid);
    ivec3 n = 2 * ivec3(grid.cells);
    int widest = max(n.x, max(n.y, n.z)), cells = 1, inner_cells = 0;
    float needed = photons * BOX, fine = 0.5 * grid.cell_size, size = fine, inner = 0.0;
    float found = photons_about(grid, first, node, 1);
    // All in the loop's head: after a break, Mesa 22.3's llvmpipe goes on with some of a SIMD group.
    while (found < max(needed, 4.0 * TELLING) && size < most && cells < widest) {
        if (inner_cells == 0 && found >= TELLING) {
            inner_cells = cells;
            inner = found;
        }
        cells *= 2;
        size *= 2.0;
        found = photons_about(grid, first, node, cells);
    }
    float best = size * sqrt(needed / max(found, 1.0e-6));
    if (inner_cells > 0) {
        float density = inner / area_about(side, grid, place, float(inner_cells) * fine, fine);
        float ratio = density / (found / area_about(side, grid, place, size, fine));
        float uneven = (ratio - 1.0) * min(1.0 / ratio, 1.0);
        float square = uneven * uneven - 1.0 / inner - 1.0 / found - UNEVEN;
        if (square > 0.0) {
            float balanced = size * size * size * size / (2.0 * square * PI * times * density * PASSES);
            best = min(best, pow(balanced, 1.0 / 6.0));
        }
    }
    return max(photons_about(grid, first, node, AROUND) > 0.0 ? min(best, most) : most, least);
}

void main() {
    int side = thread() / most_a_side, i = thread() % most_a_side;
    if (thread() < 4 * grids.length()) radii[thread()] = grids[thread() / 4][thread() % 4];
    if (thread() >= count) return;
    RadiusGrid grid = grid_of(side);
    if (i >= number_of(nodes_of(grid))) return;
    ivec3 node = place_in(nodes_of(grid), i);
    vec3 place = grid.origin + grid.cell_size * vec3(node);
    float least = pixel * (eye.w > 0.0 ? length(place - eye.xyz) : 1.0);
    radii[first_node(grid) + i] = radius_at(side, grid, node, place, least);
}
