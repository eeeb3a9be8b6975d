// SPDX-License-Identifier: GPL-3.0-or-later
// What is left of light on its way inside a mesh (Beer and Lambert). A ray is taken to be inside the mesh whose back
// it meets, all its way. Uses the tables of triangles and materials.
#include "lib/hit.glsl"
#include "lib/triangle.glsl"

vec3 left_by_absorption(Hit hit, float side) {
    if (side > 0.0) return vec3(1.0);
    return exp(-hit.t * material_at(int(triangle_at(hit_triangle(hit)).material)).absorption);
}
