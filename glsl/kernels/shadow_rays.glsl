// SPDX-License-Identifier: GPL-3.0-or-later
// Some of the visible points' shadow rays, those of a number above the last number's: for devices whose rays
// another kernel traces.
#include "lib/visible_point.glsl"

void kernel() {
    VisiblePoint point = visible_point();
    int number = first_ray + repetition();
    if (!is_place(point.place) || number >= SHADOW_RAYS) skip();
    ShadowRay ray = shadow_ray(point, number);
    if (!is_ray(ray)) skip();
    store_shadow_origin(ray.origin);
    store_shadow_direction(ray.direction);
    store_unshadowed(Radiance(ray.radiance, 1.0));
#ifdef ILLUMINANCE
    store_unshadowed_lux(Illuminance(ray.lux));
#endif
}
