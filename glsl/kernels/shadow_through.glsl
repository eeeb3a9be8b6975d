// SPDX-License-Identifier: GPL-3.0-or-later
// Send shadow rays on behind the transparent surfaces, and the glass, that they have met, with what these let through.
#include "lib/transmittance.glsl"
#include "lib/colour.glsl"
#include "lib/offset.glsl"
#ifdef PANES
#include "lib/constants.glsl"
#include "lib/shadow_pane.glsl"
#endif
#ifdef MEDIA
#include "lib/media.glsl"
#endif

void kernel() {
    Hit hit = load_shadow_hit();
    if (!is_hit(hit)) skip();
    RayDirection ray = load_shadow_direction();
    vec3 onward = ray.direction, through = vec3(0.0), radiance = load_unshadowed().radiance;
    bool is_pane = false;
#ifdef PANES
    Radiance behind = load_unshadowed_behind();
    float so_far = behind.alpha;
    bool is_distant = ray.t_max >= 0.5 * T_MAX;
    is_pane = is_distant && goes_through_pane(hit, ray.direction, onward, through);
    if (is_pane) radiance = behind.radiance;
    else behind.alpha += 1.0;
#else
    const bool is_distant = false;
    float so_far = float(passed);
#endif
    if (!is_pane) {
#ifdef TRANSPARENT
        if (load_chain().passed + so_far >= float(transparent_depth)) skip();
        onward = ray.direction;
        through = transmittance_at(hit, ray.direction);
#else
        skip();
#endif
    }
    if (!(largest(through) > 0.0)) skip();
    vec3 begin = load_shadow_origin().position, met = begin + hit.t * ray.direction;
    Triangle triangle = triangle_at(hit_triangle(hit));
    vec3 normal = normal_of(triangle.b - triangle.a, triangle.c - triangle.a);
#ifdef MEDIA
    float side = dot(normal, ray.direction) > 0.0 ? -1.0 : 1.0;
    Medium medium = load_shadow_medium();
    through *= left_after(medium.inside, begin, ray.direction, hit.t);
    store_next_medium(medium_behind(medium, hit, side));
#endif
    vec3 origin = offset_origin(met, normal, onward);
    float far = is_distant ? ray.t_max : ray.t_max - dot(origin - begin, ray.direction);
    if (!(far > 0.0)) far = 0.0;  // the light is there: nothing is left in its way
    store_next_origin(RayOrigin(origin, float(hit_triangle(hit))));
    store_next_direction(RayDirection(onward, far));
    store_next_unshadowed(Radiance(radiance * through, 1.0));
#ifdef PANES
    store_next_unshadowed_behind(Radiance(behind.radiance * through, behind.alpha));
#endif
#ifdef ILLUMINANCE
    store_next_unshadowed_lux(Illuminance(load_unshadowed_lux().lux * luminance(through)));
#endif
}
