// SPDX-License-Identifier: GPL-3.0-or-later
// What media leave of the light that shadow rays bring which meet nothing.
#include "lib/media.glsl"

void kernel() {
    RayDirection ray = load_shadow_direction();
    if (ray.direction == vec3(0.0)) skip();
    vec3 origin = load_shadow_origin().position;
    store_left(Radiance(left_after(load_shadow_medium().inside, origin, ray.direction, ray.t_max), 1.0));
}
