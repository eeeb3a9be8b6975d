// SPDX-License-Identifier: GPL-3.0-or-later
// Send shadow rays on behind the transparent surfaces that they have met, with what these let through.
#include "lib/transmittance.glsl"
#include "lib/colour.glsl"
#include "lib/offset.glsl"

void kernel() {
    Hit hit = load_shadow_hit();
    if (!is_hit(hit)) skip();
    if (load_chain().passed + float(passed) >= float(transparent_depth)) skip();
    RayDirection ray = load_shadow_direction();
    vec3 through = transmittance_at(hit, ray.direction);
    if (!(largest(through) > 0.0)) skip();
    vec3 met = load_shadow_origin().position + hit.t * ray.direction;
    Triangle triangle = triangle_at(hit_triangle(hit));
    vec3 normal = normal_of(triangle.b - triangle.a, triangle.c - triangle.a);
    vec3 origin = offset_origin(met, normal, ray.direction);
    float far = ray.t_max - dot(origin - load_shadow_origin().position, ray.direction);
    if (!(far > 0.0)) far = 0.0;  // the light is there: nothing is left in its way
    store_next_origin(RayOrigin(origin, float(hit_triangle(hit))));
    store_next_direction(RayDirection(ray.direction, far));
    store_next_unshadowed(Radiance(load_unshadowed().radiance * through, 1.0));
#ifdef ILLUMINANCE
    store_next_unshadowed_lux(Illuminance(load_unshadowed_lux().lux * luminance(through)));
#endif
}
