// SPDX-License-Identifier: GPL-3.0-or-later
// What transparent surfaces let through of a shadow ray. Uses the tables of triangles and materials.
#include "lib/hit.glsl"
#include "lib/triangle.glsl"
#ifdef PROGRAMS
#include "lib/program.glsl"
#endif

#ifdef FIRST_LOOK
bool is_left = false;  // to the second look: a ray has met a surface whose nodes tell
#endif

#ifdef SHADED_LAMPS
bool is_to_world;  // the ray: others do not pass what is transparent but to lamps
#endif

// Of a ray in this direction at a hit, per channel; 0: the surface is opaque.
vec3 transmittance_at(Hit hit, vec3 direction) {
    Material material = material_at(int(triangle_at(hit_triangle(hit)).material));
#ifdef SHADED_LAMPS
    if (!is_to_world && material.shades_lamps > 0.0) return vec3(0.0);
#endif
#if defined(FIRST_LOOK)
    is_left = is_left || material.transmittance_from != 0.0;
    if (is_left) return vec3(0.0);
#elif defined(PROGRAMS)
    if (is_given(material.transmittance_from)) {
        shading_point = shading_point_at(hit, direction, surface_at(hit, direction));
        asking = SHADOW_RAY;
        run_program(material);
        return reflectance_from(material.transmittance_from, material.transmittance);
    }
#endif
    return material.transmittance;
}
