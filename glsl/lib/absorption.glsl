// SPDX-License-Identifier: GPL-3.0-or-later
// What is left of light on its way inside a mesh (Beer and Lambert). A ray is taken to be inside the mesh whose back
// it meets, all its way; where it meets a front, inside the one from whose back it starts, as in a pool above its
// floor. Uses the tables of triangles and materials.
#include "lib/hit.glsl"
#include "lib/triangle.glsl"

vec3 left_by_absorption(Hit hit, float side, RayOrigin origin, vec3 direction) {
    bool meets_front = side > 0.0;
    int at = meets_front ? int(origin.source) : hit_triangle(hit);
    if (at < 0) return vec3(1.0);
    Triangle triangle = triangle_at(at);
    vec3 normal = normal_of(triangle.b - triangle.a, triangle.c - triangle.a);
    if (meets_front && dot(normal, direction) >= 0.0) return vec3(1.0);
    return exp(-hit.t * material_at(int(triangle.material)).absorption);
}
