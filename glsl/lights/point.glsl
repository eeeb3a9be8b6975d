// SPDX-License-Identifier: GPL-3.0-or-later
// A point light in Blender's units, I = P / (4 PI) [W/sr], or a sphere of even radiance that is as bright.
// Parameters: radius [m]. Power: W.

// A direction uniform in the cone that the light's sphere fills.
LightSample sample_point(Light light, vec3 position, vec3 normal, vec2 u) {
    float radius = light.parameters.x;
    vec3 axis_to_light = light.position - position;
    float distance2 = dot(axis_to_light, axis_to_light);
    float radius2 = radius * radius;
    if (distance2 <= radius2) return no_light();  // inside the light's sphere, which shines outwards
    vec3 to_light = axis_to_light * inversesqrt(distance2);
    float far = sqrt(distance2);
    // L = P / (4 PI^2 r^2) times the cone's solid angle takes the place of I / d^2, which it becomes as r -> 0.
    float sine2 = radius2 / distance2;
    float flatness = 1.0 + sqrt(1.0 - sine2);  // sine2 / flatness: 1 - cos of the cone, without cancellation
    vec3 irradiance = light.power / (2.0 * PI * distance2 * flatness);
    if (radius > 0.0) {
        float versine = u.x * (sine2 / flatness);
        vec3 sampled = frame_about(to_light) * direction_from_versine(versine, 2.0 * PI * u.y);
        float along = far * (1.0 - versine);
        far = along - sqrt(max(0.0, radius2 - distance2 * versine * (2.0 - versine)));
        to_light = sampled;
    }
    return LightSample(to_light, far, irradiance, 1.0);
}

// Per solid angle; 0 for a light without size, whose direction is the only one.
float pdf_point(Light light, vec3 position, vec3 normal, vec3 to_light) {
    vec3 axis = light.position - position;
    float distance2 = dot(axis, axis), sine2 = light.parameters.x * light.parameters.x / distance2;
    if (!(sine2 > 0.0 && sine2 < 1.0)) return 0.0;
    float widest = sine2 / (1.0 + sqrt(1.0 - sine2));
    return versine_between(to_light, axis * inversesqrt(distance2)) <= widest ? 1.0 / (2.0 * PI * widest) : 0.0;
}

LightRay emit_point(Light light, vec2 u, vec2 on_light) {
    return emitted_by_sphere(light, 2.0 * u.x, u.y, on_light, light.parameters.x);
}

vec3 seen_point(Light light, vec3 origin, vec3 direction, float far) {
    return seen_sphere(light, light.parameters.x, origin, direction, far);
}

LightBounds bounds_point(Light light) { return sphere_bounds(light, light.parameters.x, ALL_AROUND); }

vec3 flux_point(Light light) { return light.power; }
