// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's N-Sphere Radius of one to four dimensions, as Cycles 5.0 has it, in xyz and w: half the distance
// between the nearest point and the one nearest to that (intern/cycles/kernel/svm/voronoi.h).
// Long to compile.
// Operands: vector, w, scale randomness [dimensions].
#include "lib/voronoi.glsl"

// The cell, from `corner`, whose point is nearest to `place`; `but`: a cell that does not count.
ivec4 nearest_cell(ivec4 corner, ivec4 but, vec4 place, float randomness, int dimensions, out float nearest) {
    ivec4 reach = reach_of_cells(1, dimensions), found = ivec4(0);
    nearest = 3.402823e38;
    for (int w = -reach.w; w <= reach.w; ++w)
    for (int z = -reach.z; z <= reach.z; ++z)
    for (int y = -reach.y; y <= reach.y; ++y)
    for (int x = -reach.x; x <= reach.x; ++x) {
        ivec4 offset = ivec4(x, y, z, w);
        vec4 to = point_of_cell(corner + offset, offset, randomness, dimensions) - place;
        float there = dot(to, to);
        if (there < nearest && offset != but) {
            nearest = there;
            found = offset;
        }
    }
    nearest = sqrt(nearest);
    return found;
}

vec4 run_voronoi_radius(vec4 vector, vec4 w, vec4 shape) {
    int dimensions = int(shape.z);
    float randomness = clamp(shape.y, 0.0, 1.0), nearest = 0.0;
    vec4 place = vec4(vector.xyz, w.x);
    if (dimensions == 1) place = vec4(w.x, 0.0, 0.0, 0.0);
    else place *= vec4(reach_of_cells(1, dimensions));
    place *= shape.x;
    ivec4 cell = ivec4(floor(place)), but = ivec4(2);
    vec4 at = place - floor(place);
    for (int turn = 0; turn < 2; ++turn) {
        ivec4 offset = nearest_cell(cell, but, at, randomness, dimensions, nearest);
        cell += offset;
        at = point_of_cell(cell, ivec4(0), randomness, dimensions);
        but = ivec4(0);
    }
    return vec4(0.5 * nearest);
}
