// SPDX-License-Identifier: GPL-3.0-or-later
// The surface at a hit. Uses the tables bvh_corners (w: material, surface, number in the scene) and bvh_normals.
#include "lib/records.glsl"
#include "lib/table.glsl"
#include "lib/constants.glsl"

struct Surface {
    vec3 position;
    vec3 geometric;  // unit normal of the triangle, on the side the ray came from
    vec3 shading;    // unit interpolated normal, on the same side
    float material;
    float surface;
};

Surface surface_at(Hit hit, vec3 direction) {
    int at = 3 * hit_triangle(hit);
    vec4 a = texelFetch(bvh_corners, table_texel(at), 0);
    vec4 b = texelFetch(bvh_corners, table_texel(at + 1), 0);
    vec4 c = texelFetch(bvh_corners, table_texel(at + 2), 0);
    vec3 na = texelFetch(bvh_normals, table_texel(at), 0).xyz;
    vec3 nb = texelFetch(bvh_normals, table_texel(at + 1), 0).xyz;
    vec3 nc = texelFetch(bvh_normals, table_texel(at + 2), 0).xyz;
    float weight = 1.0 - hit.u - hit.v;
    Surface s;
    s.position = weight * a.xyz + hit.u * b.xyz + hit.v * c.xyz;
    // Scaled up before the cross product: a tiny triangle's area would underflow.
    vec3 ab = b.xyz - a.xyz, ac = c.xyz - a.xyz;
    float scale = 1.0 / max(max(max(abs(ab.x), abs(ab.y)), abs(ab.z)), max(max(abs(ac.x), abs(ac.y)), abs(ac.z)));
    s.geometric = normalize(cross(ab * scale, ac * scale));
    if (dot(s.geometric, direction) > 0.0) s.geometric = -s.geometric;
    vec3 shading = weight * na + hit.u * nb + hit.v * nc;
    float l2 = dot(shading, shading);
    s.shading = l2 > 1.0e-12 ? shading * inversesqrt(l2) : s.geometric;
    if (dot(s.shading, s.geometric) < 0.0) s.shading = -s.shading;
    s.material = a.w;
    s.surface = b.w;
    return s;
}
