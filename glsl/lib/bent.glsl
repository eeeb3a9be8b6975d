// SPDX-License-Identifier: GPL-3.0-or-later
// A point's Lambert lobe where nodes bend normals.
#include "lib/diffuse.glsl"
#include "lib/bump_shadowing.glsl"

// A point's Lambert lobe, and the smooth surface about which its normal is bent: the mesh's stands for it.
struct Bent { vec3 normal; vec3 base; };

Bent bent_of(vec3 geometric) {
    Diffuse diffuse = load_diffuse();
    vec3 shading = load_shading().normal;
    return Bent(shading, is_displaced(diffuse) ? base_of(diffuse, shading) : geometric);
}
