// SPDX-License-Identifier: GPL-3.0-or-later
// Radiance that a light would cause at each visible point, and the shadow ray that decides.
#include "lib/rng.glsl"
#include "lib/pixel.glsl"
#include "lib/light.glsl"
#include "lib/material.glsl"
#include "lib/offset.glsl"

void kernel() {
    Place place = load_place();
    if (place.surface == 0.0) skip();
    Facing facing = load_facing();
    Shading shading = load_shading();
    Light light = light_at(light_index);
    vec3 axis_to_light = light.position - place.position;
    float distance2 = dot(axis_to_light, axis_to_light);
    float radius2 = light.radius * light.radius;
    if (distance2 <= radius2) skip();  // inside the light's sphere, which shines outwards
    vec3 to_light = axis_to_light * inversesqrt(distance2);
    float far = sqrt(distance2);
    // A direction uniform in the cone that the light's sphere fills; L = P / (4 PI^2 r^2) times its
    // solid angle takes the place of I / d^2, which it becomes as r -> 0.
    float sine2 = radius2 / distance2;
    float flatness = 1.0 + sqrt(1.0 - sine2);  // sine2 / flatness: 1 - cos of the cone, without cancellation
    vec3 radiance = light.power / (2.0 * PI * distance2 * flatness);
    if (light.radius > 0.0) {
        uint dimension = DIMENSION_DIRECT + uint(depth) * 0x10000u + uint(light_index);
        vec2 u = random4(seed, pass_index, uint(pixel(element())), dimension).xy;
        float versine = u.x * (sine2 / flatness);
        vec3 sampled = frame_about(to_light) * direction_from_versine(versine, 2.0 * PI * u.y);
        float along = far * (1.0 - versine);
        far = along - sqrt(max(0.0, radius2 - distance2 * versine * (2.0 - versine)));
        to_light = sampled;
    }
    float cosine = dot(to_light, shading.normal);
    float share = eval_spot(light, versine_between(-to_light, light.axis));
    if (cosine <= 0.0 || dot(to_light, facing.normal) <= 0.0 || share <= 0.0) skip();
    vec3 to_viewer = -load_direction().direction;
    radiance *= share * cosine * eval_brdf(material_at(facing.material), shading.normal, to_light, to_viewer);
    if (largest(radiance) <= 0.0) skip();
    vec3 origin = offset_origin(place.position, facing.normal, to_light);
    store_shadow_origin(RayOrigin(origin, shading.triangle));
    // Ends short of the light, so that a light on a surface is not hidden by it: by what the origin
    // was lifted, and as much again for the rounding of the light and of the surface.
    store_shadow_direction(RayDirection(to_light, far - 2.0 * distance(origin, place.position)));
    store_unshadowed(Radiance(radiance, 1.0));
}
