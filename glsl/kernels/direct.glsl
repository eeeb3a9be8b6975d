// SPDX-License-Identifier: GPL-3.0-or-later
// Direct light at each visible point, by shadow rays.
#define ANY_HIT
#include "lib/bvh.glsl"
#include "lib/visible_point.glsl"

void kernel() {
    VisiblePoint point = visible_point();
    if (!is_place(point.place)) skip();
#ifdef TRANSPARENT
    most_passed = transparent_depth - int(point.passed);
#endif
    vec3 sum = vec3(0.0);
    float lux = 0.0;
#ifdef SHADOW_RAYS_BY_LOBES
    const int WAYS = 2;
#else
    const int WAYS = 1;
#endif
    for (int i = 0; i < WAYS * SHADOW_RAYS; i++) {
        ShadowRay ray = shadow_ray(point, i / WAYS, i % WAYS == 1);
        if (!is_ray(ray)) continue;
        RayHit found = trace(ray.origin.position, ray.direction.direction, ray.direction.t_max, int(ray.origin.source));
        if (found.triangle >= 0) continue;
#ifdef TRANSPARENT
        sum += ray.radiance * let_through;
        lux += ray.lux * luminance(let_through);
#else
        sum += ray.radiance;
        lux += ray.lux;
#endif
    }
    store_direct(Radiance(sum, 1.0));
#ifdef ILLUMINANCE
    store_illuminance(Illuminance(lux));
#endif
}
