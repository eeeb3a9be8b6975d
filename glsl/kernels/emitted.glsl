// SPDX-License-Identifier: GPL-3.0-or-later
// Find the lights that a ray meets, what media emit on its way, what the surface does where it ends, and the world that is
// behind. Lamps hide nothing: a ray goes on behind them.
#include "lib/asked_lights.glsl"
#include "lib/hit.glsl"
#include "lib/colour.glsl"
#ifdef MEDIA
#include "lib/media.glsl"
#endif
#if defined(RAYS_APART) || defined(WALKS)
#include "lib/reach.glsl"
#endif
#ifdef LINKED
#include "lib/linked.glsl"
#include "lib/triangle.glsl"

// Whether a light lights the surface that has sent a ray, which the eye has not.
bool lights_sender(Light light) {
#ifdef TRANSPARENT
    int source = int(load_chain().source);
#else
    int source = int(load_origin().source);
#endif
    return source < 0 || source >= int(NO_TRIANGLE) || lights_surface(light, triangle_at(source).surface);
}
#endif
#ifdef WEIGHED
#include "lib/chain_density.glsl"
#include "lib/triangle.glsl"
#ifdef TWO_SIDED
#include "lib/two_sided.glsl"
#endif

// The part of a lobe's ray in what it finds of a light that a shadow ray could have found (visible_lobes.glsl).
float weight_of_chain(Light light, int number, RayOrigin origin, vec3 direction, float density) {
    if (!(density > 0.0)) return 1.0;  // a delta lobe, for which there are no shadow rays
#ifdef SCATTERING
    if (density >= ALL_BY_SHADOW_RAYS) return 0.0;  // for places in media there are shadow rays alone
#endif
#ifdef TRANSPARENT
    Chain chain = load_chain();  // from where it was sent, before all that it has passed
    origin = RayOrigin(origin.position - chain.distance * direction, chain.source);
#endif
    Triangle from = triangle_at(int(origin.source));
    vec3 normal = normal_of(from.b - from.a, from.c - from.a);
    if (dot(normal, direction) < 0.0) normal = -normal;
    float rays = rays_to(number, origin.position, normal);
#ifdef TWO_SIDED
    rays *= share_of_side(int(origin.source));
#endif
    return density / (density + density_of_rays(rays, light, origin.position, normal, direction));
}

#endif

#if defined(EMISSIVE) && (defined(WEIGHED) || defined(LINKED))
// Emissive triangles are the last lights, in the order of their numbers in the scene.
int light_of_triangle(float number) {
    int low = lamps, high = light_count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (light_at(middle).parameters.w < number) low = middle + 1; else high = middle;
    }
    return low;
}
#endif

// Whether a ray that a lobe has sent finds a light.
bool is_found_by_lobe(Light light) {
#ifdef RAYS_APART
    int sent = sent_by_reach(load_direction().t_max);
    bool is_diffuse = (sent & RAY_DIFFUSE) != 0, passes = (sent & RAY_TRANSMISSION) != 0;
    if (is_diffuse && !is_found(light, passes ? BY_TRANSLUCENT : BY_DIFFUSE)) return false;
    if (passes) return is_found(light, BY_PASSING);
#endif
    return is_found(light, BY_CHAINS);
}

// What a ray meets of a light, and of the world; the kind may be known where this is compiled.
void meet(int number, float kind, RayOrigin origin, vec3 direction, float far, bool is_of_eye, inout vec3 emitted,
          inout vec3 world) {
    Light light = light_at(number);
    light.kind = kind;
    if (!(is_of_eye ? is_found(light, BY_CAMERA) : is_found_by_lobe(light))) return;
#ifdef LINKED
    if (!is_of_eye && !lights_sender(light)) return;
#endif
    vec4 seen = seen_light(light, origin.position, direction, far);
    vec3 radiance = seen.xyz * share_by_nodes(light, direction, seen.w);
    radiance *= colour_by_nodes(light, origin.position + seen.w * direction, -direction);
    if (!(largest(radiance) > 0.0)) return;
#ifdef MEDIA
    radiance *= left_after(load_medium().inside, origin.position, direction, seen.w);
#endif
#ifdef WEIGHED
    if (!is_of_eye) radiance *= weight_of_chain(light, number, origin, direction, density_of(load_throughput()));
#endif
    if (is_world(light)) world += radiance; else emitted += radiance;
}

#ifdef GLOWING
// Whether a ray finds what media emit on its way: for points in media shadow rays do.
bool glow_is_found(bool is_of_eye) {
#if defined(WEIGHED) && defined(SCATTERING)
    return is_of_eye || density_of(load_throughput()) < ALL_BY_SHADOW_RAYS;
#else
    return true;
#endif
}
#endif

void kernel() {
    RayDirection ray = load_direction();
    vec3 direction = ray.direction;
    if (direction == vec3(0.0)) skip();
#ifdef WALKS
    if (is_exit(ray.t_max)) skip();
#endif
    Hit hit = load_hit();
    RayOrigin origin = load_origin();
    float far = is_hit(hit) ? hit.t : T_MAX;
    vec3 emitted = vec3(0.0), world = vec3(0.0);
#ifdef TRANSPARENT
    bool is_of_eye = load_chain().bounces == 0.0;
#else
    bool is_of_eye = depth == 0;
#endif
#ifdef BY_KIND
    // In the table's order.
    int i = 0;
#define NEXT_IS(KIND) (i < seen_lights && light_at(i).kind == KIND)
#define MEET(KIND) for (; NEXT_IS(KIND); i++) meet(i, KIND, origin, direction, far, is_of_eye, emitted, world);
    EACH_LIGHT_KIND(MEET)
#else
    for (int i = 0; i < seen_lights; i++) {
        meet(i, light_at(i).kind, origin, direction, far, is_of_eye, emitted, world);
    }
#endif
#ifdef GLOWING
    vec2 inside = vec2(0.0);  // what an open mesh holds would not end
    if (is_hit(hit)) inside = load_medium().inside;
    Gone gone = gone_along(inside, origin.position, direction, far, far, -1, 0.0);
    if (glow_is_found(is_of_eye)) emitted += gone.glow;
#endif
#ifdef EMISSIVE
    if (is_hit(hit)) {
        Triangle triangle = triangle_at(hit_triangle(hit));
#ifdef EMISSION_BY_PROGRAMS
        vec3 emission = load_emission().radiance;
#else
        vec3 emission = material_at(int(triangle.material)).emission;
#endif
#if defined(WEIGHED) || defined(LINKED)
        if (!is_of_eye && largest(emission) > 0.0) {
            int light = light_of_triangle(triangle.number);
#ifdef LINKED
            if (!lights_sender(light_at(light))) emission = vec3(0.0);
#endif
#ifdef WEIGHED
            emission *= weight_of_chain(light_at(light), light, origin, direction, density_of(load_throughput()));
#endif
        }
#endif
#ifdef MEDIA
#ifdef GLOWING
        emission *= exp(-gone.depth);
#else
        emission *= left_after(load_medium().inside, origin.position, direction, hit.t);
#endif
#endif
        emitted += emission;
    }
#endif
    store_emitted(Radiance(emitted, 1.0));
    store_environment(Radiance(world, 1.0));
}
