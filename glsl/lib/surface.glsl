// SPDX-License-Identifier: GPL-3.0-or-later
// The surface at a hit. Uses the tables of triangles and of their normals.
#include "lib/hit.glsl"
#include "lib/smooth_normal.glsl"
#include "lib/triangle.glsl"

struct Surface {
    vec3 position;
    vec3 geometric;  // unit normal of the triangle, on the side the ray came from
    vec3 shading;    // unit interpolated normal, on the same side
    float side;      // which that is: 1 where the triangle's corners go round to the left, -1 behind it
    int material;
    float surface;
    int flags;       // of its material; see lib/triangle.glsl
};

Surface surface_at(Hit hit, vec3 direction) {
    Triangle triangle = triangle_at(hit_triangle(hit));
    CornerNormals normals = corner_normals_at(hit_triangle(hit));
    float weight = 1.0 - hit.u - hit.v;
    Surface s;
    s.position = weight * triangle.a + hit.u * triangle.b + hit.v * triangle.c;
    s.geometric = normal_of(triangle.b - triangle.a, triangle.c - triangle.a);
    s.side = dot(s.geometric, direction) > 0.0 ? -1.0 : 1.0;
    s.geometric *= s.side;
    s.shading = smooth_normal(normals, vec3(weight, hit.u, hit.v), s.geometric);
    s.material = int(triangle.material);
    s.surface = triangle.surface;
    s.flags = int(normals.flags);
    return s;
}
