// SPDX-License-Identifier: GPL-3.0-or-later
// Deposit each photon in world space where it meets a diffuse surface (Marino & Abbate, Projector).
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/packing.glsl"

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !is_diffuse(load_diffuse())) skip();
    store_landed(place);
    store_deposit(Deposit(load_flux().flux, pack_direction(load_facing().normal)));
}
