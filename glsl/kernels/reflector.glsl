// SPDX-License-Identifier: GPL-3.0-or-later
// Scatter or absorb each photon by Russian roulette with mean(k_d) and mean(k_s); a survivor's flux
// takes the surface's colour (Marino & Abbate, Reflector; Jensen 2001, sec. 5.2).
#include "lib/rng.glsl"
#include "lib/sampling.glsl"
#include "lib/surface.glsl"
#include "lib/offset.glsl"
#include "lib/material.glsl"

void kernel() {
    Hit hit = load_hit();
    if (!is_hit(hit)) skip();
    vec3 incoming = load_direction().direction;
    Flux photon = load_flux();
    vec3 flux = photon.flux;
    Surface surface = surface_at(hit, incoming);
    Material material = material_at(surface.material);
    uint dimension = DIMENSION_REFLECT + uint(bounce);
    vec4 u = random4(seed, pass_index, uint(photon.photon), dimension);

    float diffuse = mean(material.diffuse), specular = mean(material.specular);
    vec3 outgoing;
    if (u.x < diffuse) {
        // About the geometric normal: on it the photon's flux fell, and no direction leaves the
        // wrong side, so the energy ledger closes whatever the shading normals are.
        outgoing = frame_about(surface.geometric) * sample_cosine_hemisphere(u.yz);
        flux *= material.diffuse / diffuse;
    } else if (u.x < diffuse + specular) {
        vec3 mirrored = reflect(incoming, surface.shading);
        outgoing = material.exponent < 0.0
            ? mirrored
            : frame_about(mirrored) * sample_phong_lobe(material.exponent, u.yz);
        flux *= material.specular / specular * specular_weight(material, dot(outgoing, surface.shading));
    } else {
        skip();
    }
    if (dot(outgoing, surface.geometric) <= 0.0 || largest(flux) <= 0.0) skip();
    store_next_origin(RayOrigin(offset_origin(surface.position, surface.geometric, outgoing), float(hit_triangle(hit))));
    store_next_direction(RayDirection(outgoing, T_MAX));
    store_next_flux(Flux(flux, photon.photon));
}
