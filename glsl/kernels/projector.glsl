// SPDX-License-Identifier: GPL-3.0-or-later
// Deposit each photon in world space where it meets a surface that gathers (Marino & Abbate, Projector).
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/packing.glsl"
#include "lib/photon_number.glsl"
#include "lib/arriving_flux.glsl"
#ifdef ARRIVALS
#include "lib/arrival.glsl"
#endif
#ifdef CAUSTICS
#include "lib/specular_photon.glsl"
#endif
#ifdef PANES
#include "lib/pane.glsl"
#endif
#ifdef VISIBILITY
#include "lib/photon_ray.glsl"

// Whether a diffuse ray from here could have found the photon; with FIRST_HITS also one straight from a light.
bool may_land() {
    int rays = photon_ray(load_direction()).rays;
#ifdef FIRST_HITS
    if ((rays & (RAY_SHADOW + RAY_UNSHADOWED)) != 0) return true;
#endif
    return (rays & RAY_DIFFUSE) != 0;
}
#endif

const float FIRST_HIT = 0.5;  // what the number of a photon that has not bounced has more

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
#ifdef VISIBILITY
    if (!may_land()) skip();
#endif
#ifdef PANES
    if (is_straight(load_medium().sent, load_direction().direction)) skip();  // direct light
#endif
    vec3 flux = arriving_flux(load_flux().flux);
#ifdef ARRIVALS
    flux *= share_of_arrival(load_origin(), place, BY_DIFFUSE);
    if (flux == vec3(0.0)) skip();
#endif
    place.surface = of_part(place.surface, int(photon_part(load_flux())));
    store_landed(place);
#ifdef CAUSTICS
    if (came_by_lobe(load_direction())) store_caustic(place);
    else store_caustic(Place(vec3(0.0), 0.0));
#endif
#ifdef DIRECTIONS
    flux = flux_with_direction(flux, -load_direction().direction);
#endif
    if (numbered) {
        float number = float(photon_number(load_flux())) + (bounce == 0 ? FIRST_HIT : 0.0);
        flux = vec3(flux.r + flux.g + flux.b, number, 0.0);
    }
    store_deposit(Deposit(flux, pack_direction(load_facing().normal)));
}
