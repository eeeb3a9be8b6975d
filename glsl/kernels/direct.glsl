// SPDX-License-Identifier: GPL-3.0-or-later
// Direct light at each visible point, by shadow rays. Where what they pass is told by nodes there are two looks: the
// first, which knows no nodes, leaves points to the second whose rays meet such surfaces. One program that knows all
// takes a GPU's registers from each of its threads, few of which run nodes.
#ifndef PANES
#ifndef MEDIA
#define ANY_HIT
#endif
#endif
#include "lib/bvh.glsl"
#include "lib/visible_point.glsl"
#ifndef ANY_HIT
#include "lib/transmittance.glsl"
#include "lib/colour.glsl"
#ifdef PANES
#include "lib/shadow_pane.glsl"
#endif
#ifdef MEDIA
#include "lib/shadow_medium.glsl"
#endif

vec3 let_through;  // by what the last ray has met
int most_passed;   // transparent surfaces that a ray may pass
const int MOST_FACES = 1024;  // of glass: less light than floats tell is left behind so many

// Whether a ray comes to its light by what it meets, one after the other; if that is glass, radiance becomes what it
// brings behind it.
bool is_free(inout ShadowRay ray) {
    let_through = vec3(1.0);
    RayOrigin origin = ray.origin;
    vec3 direction = ray.direction.direction;
    float far = ray.direction.t_max;
    bool is_distant = far >= 0.5 * T_MAX;
    int passed = 0;
#ifdef MEDIA
    Medium medium = medium_towards(direction);
#endif
    for (int faces = 0;;) {
        RayHit found = trace(origin.position, direction, far, int(origin.source));
        if (found.triangle < 0) break;
        Hit hit = Hit(found.t, stored_triangle(found.triangle), found.u, found.v);
        vec3 through = vec3(0.0), onward = direction;
        bool is_pane = false;
#ifdef PANES
        is_pane = is_distant && goes_through_pane(hit, direction, onward, through);
        if (is_pane) {
            if (++faces > MOST_FACES) return false;
            ray.radiance = ray.behind;
        }
#endif
#ifdef TRANSPARENT
        if (!is_pane && ++passed <= most_passed) {
            through = transmittance_at(hit, direction);
            onward = direction;
        }
#endif
        let_through *= through;
        if (!(largest(let_through) > 0.0)) return false;
        Triangle triangle = triangle_at(found.triangle);
        vec3 normal = normal_of(triangle.b - triangle.a, triangle.c - triangle.a);
#ifdef MEDIA
        float side = dot(normal, direction) > 0.0 ? -1.0 : 1.0;
        let_through *= left_after(medium.inside, origin.position, direction, hit.t);
        medium = medium_behind(medium, hit, side);
#endif
        vec3 next = offset_origin(origin.position + found.t * direction, normal, onward);
        if (!is_distant) far -= dot(next - origin.position, direction);
        if (!(far > 0.0)) return true;  // the light is there
        origin = RayOrigin(next, float(found.triangle));
        direction = onward;
    }
#ifdef MEDIA
    if (ray.is_to_world) medium.inside = vec2(air, 0.0);  // as FreeFlight, of rays that meet nothing
    let_through *= left_after(medium.inside, origin.position, direction, far);
#endif
#ifdef PANES
    return dot(direction, ray.direction.direction) > STRAIGHT;
#else
    return true;
#endif
}
#endif

void kernel() {
#ifdef SECOND_LOOK
    Radiance looked = load_looked();
    if (looked.alpha == 1.0) {
        store_direct(looked);
#ifdef ILLUMINANCE
        store_illuminance(load_looked_lux());
#endif
        return;
    }
#endif
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
#ifdef PORTALS
    int more = world_rays - 1;  // to the world: of the numbers below 0
#else
    const int more = 0;
#endif
    for (int i = -WAYS * more; i < WAYS * SHADOW_RAYS; i++) {
        int number = (i + WAYS * more) / WAYS - more;
        ShadowRay ray = shadow_ray(point, number, (i & (WAYS - 1)) == 1);
        if (!is_ray(ray)) continue;
#ifdef SHADED_LAMPS
        is_to_world = ray.is_to_world;
#endif
#ifndef ANY_HIT
        bool is_lit = is_free(ray);
#ifdef FIRST_LOOK
        if (is_left) break;
#endif
        if (!is_lit) continue;
#else
        RayHit found = trace(ray.origin.position, ray.direction.direction, ray.direction.t_max, int(ray.origin.source));
        if (found.triangle >= 0) continue;
#endif
#if defined(TRANSPARENT) || !defined(ANY_HIT)
        sum += ray.radiance * let_through;
        lux += ray.lux * luminance(let_through);
#else
        sum += ray.radiance;
        lux += ray.lux;
#endif
    }
    float is_known = 1.0;
#ifdef FIRST_LOOK
    if (is_left) is_known = 0.0;
#endif
    store_direct(Radiance(sum, is_known));
#ifdef ILLUMINANCE
    store_illuminance(Illuminance(lux));
#endif
}
