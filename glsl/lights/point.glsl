// SPDX-License-Identifier: GPL-3.0-or-later
// A point light in Blender's units, I = P / (4 PI) [W/sr], or with a radius one of two that are as bright from afar:
// a sphere of even radiance, in which a place is lit from all around; or, with a soft falloff, a disc that faces
// whoever looks, so that no light is nearer than its size.
// Parameters: radius [m], soft [0 or 1]. Power: W.

bool is_inside(Light light, float distance2) {
    return light.parameters.y == 0.0 && distance2 <= light.parameters.x * light.parameters.x;
}

// Of the angle between the light's middle and its rim.
float sine2_of_point(Light light, float distance2) {
    float radius2 = light.parameters.x * light.parameters.x;
    return radius2 / (light.parameters.y > 0.0 ? distance2 + radius2 : distance2);
}

// A direction uniform in the cone that the light fills; inside its sphere by the cosine.
LightSample sample_point(Light light, vec3 position, vec3 normal, vec2 u) {
    float radius = light.parameters.x;
    vec3 axis_to_light = light.position - position;
    float distance2 = dot(axis_to_light, axis_to_light);
    if (is_inside(light, distance2) && radius > 0.0) {
        vec3 local = sample_cosine_hemisphere(u);
        if (!(local.z > 0.0)) return no_light();
        vec3 direction = frame_about(normal) * local;
        vec4 seen = seen_sphere(light, radius, position, direction, T_MAX);
        return LightSample(direction, seen.w, seen.xyz * (PI / local.z), 1.0);
    }
    if (!(distance2 > 0.0)) return no_light();
    vec3 to_light = axis_to_light * inversesqrt(distance2);
    float far = sqrt(distance2);
    // L = P / (4 PI^2 r^2) times the cone's solid angle takes the place of I / d^2, which it becomes as r -> 0.
    float sine2 = sine2_of_point(light, distance2);
    float flatness = 1.0 + sqrt(1.0 - sine2);  // sine2 / flatness: 1 - cos of the cone, without cancellation
    float reach2 = light.parameters.y > 0.0 ? distance2 + radius * radius : distance2;
    vec3 irradiance = light.power / (2.0 * PI * reach2 * flatness);
    if (radius > 0.0) {
        float versine = u.x * (sine2 / flatness);
        vec3 sampled = frame_about(to_light) * direction_from_versine(versine, 2.0 * PI * u.y);
        if (light.parameters.y > 0.0) {
            far /= 1.0 - versine;
        } else {
            float along = far * (1.0 - versine);
            far = along - sqrt(max(0.0, radius * radius - distance2 * versine * (2.0 - versine)));
        }
        to_light = sampled;
    }
    return LightSample(to_light, far, irradiance, 1.0);
}

// Per solid angle; 0 for a light without size, whose direction is the only one.
float pdf_point(Light light, vec3 position, vec3 normal, vec3 to_light) {
    vec3 axis = light.position - position;
    float distance2 = dot(axis, axis);
    if (!(light.parameters.x > 0.0)) return 0.0;
    if (is_inside(light, distance2)) return pdf_cosine_hemisphere(dot(normal, to_light));
    if (!(distance2 > 0.0)) return 0.0;
    float sine2 = sine2_of_point(light, distance2);
    float widest = sine2 / (1.0 + sqrt(1.0 - sine2));
    return versine_between(to_light, axis * inversesqrt(distance2)) <= widest ? 1.0 / (2.0 * PI * widest) : 0.0;
}

vec4 seen_point(Light light, vec3 origin, vec3 direction, float far) {
    return light.parameters.y > 0.0 ? seen_facing_disc(light, light.parameters.x, origin, direction, far)
                                    : seen_sphere(light, light.parameters.x, origin, direction, far);
}

LightRay emitted_by_point(Light light, vec3 direction, vec2 on_light) {
    return emitted_by_sphere(light, direction, on_light, light.parameters.x, light.parameters.y == 0.0);
}

LightRay emit_point(Light light, vec2 u, vec2 on_light) {
#ifdef PROFILES
    if (has_profile(light)) {
        float weight;
        LightRay emitted = emitted_by_point(light, sample_profile(light, u, weight), on_light);
        emitted.weight = weight;
        return emitted;
    }
#endif
    return emitted_by_point(light, about_axis(light, 2.0 * u.x, u.y), on_light);
}

LightBounds bounds_point(Light light) { return sphere_bounds(light, light.parameters.x, ALL_AROUND); }

vec3 flux_point(Light light) { return light.power; }
