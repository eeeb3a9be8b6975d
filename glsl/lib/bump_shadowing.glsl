// SPDX-License-Identifier: GPL-3.0-or-later
// What normals of nodes shade that the smooth surface about them hides, as Cycles has it (bump_shadowing_term): no
// light that comes from behind that surface; and Lambert's lobe darkens softly towards there (Conty Estevez, Lecocq &
// Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem"). Uses the tables of triangles
// and of their normals.
#include "lib/diffuse.glsl"
#include "lib/triangle.glsl"

// The normal of the smooth surface, unit and on the ray's side.
vec3 base_normal(Place place, Facing facing, Shading shading, Diffuse diffuse) {
    if (is_displaced(diffuse)) return base_of(diffuse, shading.normal);
    CornerNormals normals = corner_normals_at(int(shading.triangle));
    vec3 share = corner_shares(triangle_at(int(shading.triangle)), place.position);
    vec3 normal = share.x * normals.a + share.y * normals.b + share.z * normals.c;
    float l2 = dot(normal, normal);
    normal = l2 > 1.0e-12 ? normal * inversesqrt(l2) : facing.normal;
    return dot(normal, facing.normal) < 0.0 ? -normal : normal;
}

// Whether light from there is on the other side of the smooth surface, `base`.
bool leaks(vec3 base, vec3 normal, vec3 to_light) {
    return normal != base && dot(base, to_light) * dot(base, normal) * dot(normal, to_light) < 0.0;
}

// The share of light that Lambert's lobe keeps.
float bump_shadowing(vec3 base, vec3 normal, vec3 to_light) {
    if (normal == base) return 1.0;
    if (leaks(base, normal, to_light)) return 0.0;
    float light = abs(dot(base, to_light)), bent = abs(dot(base, normal));
    if (bent >= 1.0 || light >= 1.0) return 1.0;
    if (light < 1.0e-6) return 0.0;
    float alpha2 = clamp(0.125 * (1.0 / (bent * bent) - 1.0), 0.0, 1.0);
    // Smith's masking of GGX.
    return 2.0 / (1.0 + sqrt(1.0 + alpha2 * (1.0 / (light * light) - 1.0)));
}
