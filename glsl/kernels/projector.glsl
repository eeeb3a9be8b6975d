// SPDX-License-Identifier: GPL-3.0-or-later
// Deposit each photon in world space where it meets a surface that gathers (Marino & Abbate, Projector).
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/packing.glsl"
#ifdef VISIBILITY
#include "lib/photon_ray.glsl"

// Whether it may have been found by a ray from here: of light that has not been scattered, if that is stored.
bool is_found() {
    int rays = photon_ray(load_direction()).rays;
#ifdef FIRST_HITS
    if ((rays & (RAY_SHADOW + RAY_UNSHADOWED)) != 0) return true;
#endif
    return (rays & RAY_DIFFUSE) != 0;
}
#endif

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
#ifdef VISIBILITY
    if (!is_found()) skip();
#endif
    store_landed(place);
    vec3 flux = load_flux().flux;
#ifdef DIRECTIONS
    flux = flux_with_direction(flux, -load_direction().direction);
#endif
    store_deposit(Deposit(flux, pack_direction(load_facing().normal)));
}
