// SPDX-License-Identifier: GPL-3.0-or-later
// Deposit each photon in world space where it meets a surface that gathers (Marino & Abbate, Projector).
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/packing.glsl"
#ifdef ARRIVALS
#include "lib/arrival.glsl"
#endif

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
    vec3 flux = load_flux().flux;
#ifdef ARRIVALS
    flux *= share_of_arrival(load_origin(), place.position, BY_DIFFUSE);
    if (flux == vec3(0.0)) skip();
#endif
    store_landed(place);
#ifdef DIRECTIONS
    flux = flux_with_direction(flux, -load_direction().direction);
#endif
    store_deposit(Deposit(flux, pack_direction(load_facing().normal)));
}
