// SPDX-License-Identifier: GPL-3.0-or-later
// Scatter or absorb each photon by Russian roulette with the mean albedos of Lambert's lobe and of another; a
// survivor's flux takes the surface's colour (Marino & Abbate, Reflector; Jensen 2001, sec. 5.2).
#include "lib/rng.glsl"
#include "lib/sampling.glsl"
#include "lib/offset.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#ifdef LOBES
#include "lib/lobe.glsl"
#endif
#ifdef ARRIVALS
#include "lib/arrival.glsl"
#endif

void kernel() {
    Place place = load_place();
    if (!is_place(place)) skip();
    Facing facing = load_facing();
    Shading shading = load_shading();
    Diffuse diffuse = load_diffuse();
    Flux photon = load_flux();
    vec3 flux = photon.flux, outgoing;
    vec4 u = random4(seed, pass_index, uint(photon.photon), DIMENSION_REFLECT + uint(bounce));
    float by_diffuse = mean(diffuse.albedo), by_lobe = 0.0;
#ifdef LOBES
    Lobe lobe = load_lobe0();
    Shape shape = load_shape0();
    vec3 incoming = load_direction().direction;
    by_lobe = mean(albedo_lobe(lobe, shape, max(0.0, -dot(incoming, shading.normal))));
    float all = max(1.0, by_diffuse + by_lobe);
    by_diffuse /= all;
    by_lobe /= all;
#endif
    if (u.x < by_diffuse) {
        // About the geometric normal: on it the photon's flux fell, and no direction leaves the
        // wrong side, so the energy ledger closes whatever the shading normals are.
        outgoing = frame_about(facing.normal) * sample_cosine_hemisphere(u.yz);
        flux *= diffuse.albedo / by_diffuse;
#ifdef ARRIVALS
        flux *= share_of_arrival(load_origin(), place.position, BY_DIFFUSE);
#endif
#ifdef LOBES
        // It goes on to the eye: that is the direction by which layers are weighed.
        if (is_covered(diffuse)) flux *= passed_by_lobe(lobe, shape, max(0.0, dot(outgoing, shading.normal)));
    } else if (u.x < by_diffuse + by_lobe) {
        vec3 weight;
        vec3 normal = raised_normal(shading.normal, facing.normal, -incoming);
        outgoing = sample_lobe_for_photon(lobe, shape, normal, -incoming, u.yz, weight);
        flux *= weight / by_lobe;
#ifdef ARRIVALS
        flux *= share_of_arrival(load_origin(), place.position, BY_GLOSSY);
#endif
#endif
    } else {
        skip();
    }
    if (!(dot(outgoing, facing.normal) > 0.0) || !(largest(flux) > 0.0)) skip();
    store_next_origin(RayOrigin(offset_origin(place.position, facing.normal, outgoing), shading.triangle));
    store_next_direction(RayDirection(outgoing, T_MAX));
    store_next_flux(Flux(flux, photon.photon));
}
