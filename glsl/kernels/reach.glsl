// SPDX-License-Identifier: GPL-3.0-or-later
// How far each visible point looks for photons: the same for every splat that covers its pixel.
#include "lib/radius.glsl"
#include "lib/place.glsl"

void kernel() {
    Place place = load_place();
    if (!is_place(place)) skip();
    store_reach(Reach(radius_at(place.position, load_facing().normal)));
}
