// SPDX-License-Identifier: GPL-3.0-or-later
// A photon's number, on which its random numbers hang, among those of its pass; photons of several may be under way
// together. With DISPERSION what holds it is below zero once the photon has taken the colour of its wavelength
// (wavelength.glsl).
#include "lib/of_part.glsl"

float held_number(int photon, int part) { return of_part(float(photon + 1), part); }
uint photon_number(Flux photon) { return uint(abs(without_part(photon.photon))) - 1u; }
uint photon_part(Flux photon) { return uint(part_in(photon.photon)); }
#ifdef DISPERSION
bool has_colour(Flux photon) { return photon.photon < 0.0; }
Flux with_colour(Flux photon) { return Flux(photon.flux, -abs(photon.photon)); }
#endif
