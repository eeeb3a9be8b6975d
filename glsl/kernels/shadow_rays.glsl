// SPDX-License-Identifier: GPL-3.0-or-later
// The visible points' shadow rays of one number: for devices whose rays the host traces.
#include "lib/visible_point.glsl"
#ifdef MEDIA
#include "lib/shadow_medium.glsl"
#endif

void kernel() {
    VisiblePoint point = visible_point();
    if (!is_place(point.place)) skip();
#ifdef SHADOW_RAYS_BY_LOBES
    ShadowRay ray = shadow_ray(point, number, by_lobe == 1);
#else
    ShadowRay ray = shadow_ray(point, number, false);
#endif
    if (!is_ray(ray)) skip();
    store_shadow_origin(ray.origin);
    store_shadow_direction(ray.direction);
    store_unshadowed(Radiance(ray.radiance, 1.0));
#ifdef MEDIA
    store_shadow_medium(medium_towards(ray.direction.direction));
#endif
#ifdef PANES
    store_unshadowed_behind(Radiance(ray.behind, 0.0));  // transparent surfaces passed, too
#endif
#ifdef ILLUMINANCE
    store_unshadowed_lux(Illuminance(ray.lux));
#endif
}
