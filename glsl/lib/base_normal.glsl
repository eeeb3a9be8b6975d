// SPDX-License-Identifier: GPL-3.0-or-later
// The smooth surface about which nodes bend normals. Uses the tables of triangles and of their normals.
#include "lib/diffuse.glsl"
#include "lib/constants.glsl"
#include "lib/smooth_normal.glsl"
#include "lib/triangle.glsl"

// The normal of the smooth surface, unit and on the ray's side.
vec3 base_normal(Place place, Facing facing, Shading shading, Diffuse diffuse) {
    if (is_displaced(diffuse)) return base_of(diffuse, shading.normal);
#ifdef SCATTERING
    if (shading.triangle == NO_TRIANGLE) return shading.normal;  // a medium's point
#endif
    CornerNormals normals = corner_normals_at(int(shading.triangle));
    vec3 share = corner_shares(triangle_at(int(shading.triangle)), place.position);
    return smooth_normal(normals, share, facing.normal);
}
