// SPDX-License-Identifier: GPL-3.0-or-later
// Deposit each photon in world space where it meets a surface that gathers (Marino & Abbate, Projector).
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/packing.glsl"

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
    store_landed(place);
    vec3 flux = load_flux().flux;
#ifdef DIRECTIONS
    flux = flux_with_direction(flux, -load_direction().direction);
#endif
    store_deposit(Deposit(flux, pack_direction(load_facing().normal)));
}
