// SPDX-License-Identifier: GPL-3.0-or-later
// The gather radius of each visible point: the same for every splat that covers its pixel.
#include "lib/radius.glsl"
#include "lib/place.glsl"

void kernel() {
    Place place = load_place();
    if (!is_place(place)) skip();
    float radius = radius_at(place.position, load_facing().normal);
    store_gather_radius(GatherRadius(cut_radius(radius, load_cuts().first)));
}
