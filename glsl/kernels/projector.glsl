// SPDX-License-Identifier: GPL-3.0-or-later
// Deposit each photon in world space where it meets a diffuse surface (Marino & Abbate, Projector).
#include "lib/surface.glsl"
#include "lib/material.glsl"
#include "lib/packing.glsl"

void kernel() {
    Hit hit = load_hit();
    if (!is_hit(hit)) skip();
    Surface surface = surface_at(hit, load_direction().direction);
    if (largest(material_at(surface.material).diffuse) <= 0.0) skip();
    store_place(Place(surface.position, surface.surface + 1.0));
    store_deposit(Deposit(load_flux().flux, pack_direction(surface.geometric)));
}
