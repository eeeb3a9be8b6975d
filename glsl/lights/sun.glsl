// SPDX-License-Identifier: GPL-3.0-or-later
// The sun: a disc in the sky of even radiance, or one direction. Photons of it start on a disc before the scene.
// Parameters: widest [1 - cos], bounds [scene]. Power: W/m^2.

// The solid angle of the sun's disc times its mean cosine is PI sin^2; over this, irradiance is of the cone alone.
float mean_cosine_of_sun(Light light) { return 1.0 - 0.5 * light.parameters.x; }

LightSample sample_sun(Light light, vec3 position, vec3 normal, vec2 u) {
    vec3 direction = direction_from_versine(light.parameters.x * u.x, 2.0 * PI * u.y);
    return LightSample(frame_about(-light.axis) * direction, T_MAX, light.power / mean_cosine_of_sun(light), 1.0);
}

// Per solid angle; 0 for a sun without size, whose direction is the only one.
float pdf_sun(Light light, vec3 position, vec3 normal, vec3 to_light) {
    float widest = light.parameters.x;
    return widest > 0.0 && versine_between(to_light, -light.axis) <= widest ? 1.0 / (2.0 * PI * widest) : 0.0;
}

vec4 seen_sun(Light light, vec3 origin, vec3 direction, float far) {
    if (far < T_MAX) return vec4(0.0);
    return vec4(light.power * (pdf_sun(light, origin, direction, direction) / mean_cosine_of_sun(light)), T_MAX);
}

LightRay emit_sun(Light light, vec2 u, vec2 on_light) {
    vec3 direction = direction_from_versine(light.parameters.x * u.x, 2.0 * PI * u.y);
    return emitted_by_surroundings(frame_about(light.axis) * direction, on_light, light.parameters.y);
}

vec3 flux_sun(Light light) {
    float bounds = light.parameters.y;
    return light.power * (PI * bounds * bounds / mean_cosine_of_sun(light));
}
