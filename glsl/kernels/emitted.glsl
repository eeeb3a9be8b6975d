// SPDX-License-Identifier: GPL-3.0-or-later
// Find the lights that a ray meets, what glows where it ends, and the world that is behind. Lamps hide nothing: a
// ray goes on behind them.
#include "lib/asked_lights.glsl"
#include "lib/hit.glsl"
#include "lib/colour.glsl"
#ifdef WEIGHED
#include "lib/chain_density.glsl"
#include "lib/triangle.glsl"
#ifdef TWO_SIDED
#include "lib/two_sided.glsl"
#endif

// The part of a lobe's ray in what it finds of a light that a shadow ray could have found (shadow_ray.glsl).
float weight_of_chain(int number, RayOrigin origin, vec3 direction, float density) {
    if (!(density > 0.0)) return 1.0;  // a delta lobe, for which there are no shadow rays
#ifdef TRANSPARENT
    Chain chain = load_chain();  // from where it was sent, before all that it has passed
    origin = RayOrigin(origin.position - chain.way * direction, chain.source);
#endif
    Triangle from = triangle_at(int(origin.source));
    vec3 normal = normal_of(from.b - from.a, from.c - from.a);
    if (dot(normal, direction) < 0.0) normal = -normal;
    float rays = rays_to(number, origin.position, normal);
#ifdef TWO_SIDED
    rays *= share_of_side(int(origin.source));
#endif
    return density / (density + density_of_rays(rays, light_at(number), origin.position, normal, direction));
}

#ifdef GLOWS
// Triangles that glow are the last lights, in the order of their numbers in the scene.
int light_of_triangle(float number) {
    int low = lamps, high = light_count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (light_at(middle).parameters.w < number) low = middle + 1; else high = middle;
    }
    return low;
}
#endif
#endif

void kernel() {
    RayDirection ray = load_direction();
    vec3 direction = ray.direction;
    if (direction == vec3(0.0)) skip();
    Hit hit = load_hit();
    RayOrigin origin = load_origin();
    float far = is_hit(hit) ? hit.t : T_MAX;
    vec3 emitted = vec3(0.0), world = vec3(0.0);
#ifdef TRANSPARENT
    bool is_of_eye = load_chain().bounces == 0.0;
#else
    bool is_of_eye = depth == 0;
#endif
    for (int i = 0; i < seen_lights; i++) {
        Light light = light_at(i);
        if (!is_found(light, is_of_eye ? BY_CAMERA : BY_CHAINS)) continue;
        vec4 seen = seen_light(light, origin.position, direction, far);
        vec3 radiance = seen.xyz * share_by_nodes(light, direction, seen.w);
#ifdef GOBOS
        radiance *= gobo_colour(light, origin.position + seen.w * direction, -direction);
#endif
        if (!(largest(radiance) > 0.0)) continue;
#ifdef WEIGHED
        if (!is_of_eye) radiance *= weight_of_chain(i, origin, direction, density_of(load_throughput()));
#endif
        if (is_found(light, IS_WORLD)) world += radiance; else emitted += radiance;
    }
#ifdef GLOWS
    if (is_hit(hit)) {
        Triangle triangle = triangle_at(hit_triangle(hit));
#ifdef GLOWS_BY_PROGRAMS
        vec3 glow = load_glow().radiance;
#else
        vec3 glow = material_at(int(triangle.material)).emission;
#endif
#ifdef WEIGHED
        if (!is_of_eye && largest(glow) > 0.0) {
            int light = light_of_triangle(triangle.number);
            glow *= weight_of_chain(light, origin, direction, density_of(load_throughput()));
        }
#endif
        emitted += glow;
    }
#endif
    store_emitted(Radiance(emitted, 1.0));
    store_environment(Radiance(world, 1.0));
}
