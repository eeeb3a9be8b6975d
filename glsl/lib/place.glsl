// SPDX-License-Identifier: GPL-3.0-or-later
// Places hold their surface's number plus one: zero is no place. Exact below 2^24.

bool is_place(Place place) { return place.surface > 0.0; }
float surface_number(Place place) { return place.surface - 1.0; }
float stored_surface(float surface) { return surface + 1.0; }
