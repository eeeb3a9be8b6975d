// SPDX-License-Identifier: GPL-3.0-or-later
// Places hold the number plus one of their surface and, by its sign, the side of it: below zero the back. Zero is
// no place. Exact below 2^24. What a medium scatters is on no surface of the scene's. Where photons have landed they
// tell their pass, too (of_part.glsl).
#include "lib/constants.glsl"

bool is_place(Place place) { return place.surface != 0.0; }
float surface_number(Place place) { return abs(place.surface) - 1.0; }
bool is_in_medium(Place place) { return surface_number(place) == IN_MEDIUM; }
float stored_surface(float surface, float side) { return side * (surface + 1.0); }
