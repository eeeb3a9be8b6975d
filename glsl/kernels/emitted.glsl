// SPDX-License-Identifier: GPL-3.0-or-later
// Find the lights that a ray meets, and the world that it ends in. Lights hide nothing: a ray goes on behind them.
#include "lib/light_choice.glsl"
#include "lib/hit.glsl"
#include "lib/colour.glsl"
#ifdef WEIGHED
#include "lib/triangle.glsl"

// The part of a lobe's ray in what it finds of a light that a shadow ray could have found (shadow_ray.glsl).
float weight_of_chain(Light light, RayOrigin origin, vec3 direction, float density) {
    if (!(density > 0.0)) return 1.0;  // a delta lobe, for which there are no shadow rays
    Triangle from = triangle_at(int(origin.source));
    vec3 normal = normal_of(from.b - from.a, from.c - from.a);
    if (dot(normal, direction) < 0.0) normal = -normal;
    return density / (density + density_of_rays_to(light, origin.position, normal, direction));
}
#endif

void kernel() {
    RayDirection ray = load_direction();
    vec3 direction = ray.direction;
    if (direction == vec3(0.0)) skip();
    Hit hit = load_hit();
    RayOrigin origin = load_origin();
    float far = is_hit(hit) ? hit.t : T_MAX;
    vec3 lamps = vec3(0.0), world = vec3(0.0);
    for (int i = 0; i < seen_lights; i++) {
        Light light = light_at(i);
        if (!is_found(light, depth == 0 ? BY_CAMERA : BY_CHAINS)) continue;
        vec4 seen = seen_light(light, origin.position, direction, far);
        vec3 radiance = seen.xyz * share_by_nodes(light, direction, seen.w);
        if (!(largest(radiance) > 0.0)) continue;
#ifdef WEIGHED
        if (depth > 0) radiance *= weight_of_chain(light, origin, direction, load_throughput().density);
#endif
        if (is_found(light, IS_WORLD)) world += radiance; else lamps += radiance;
    }
    store_emitted(Radiance(lamps, 1.0));
    store_environment(Radiance(world, 1.0));
}
