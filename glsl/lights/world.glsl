// SPDX-License-Identifier: GPL-3.0-or-later
// The world, of one radiance from everywhere: what is behind all else. Photons of it start on discs before the scene.
// Parameters: bounds [scene]. Power: W/(m^2 sr).

// By the cosine: what remains for a diffuse surface is exact.
LightSample sample_world(Light light, vec3 position, vec3 normal, vec2 u) {
    vec3 local = sample_cosine_hemisphere(u);
    if (!(local.z > 0.0)) return no_light();
    return LightSample(frame_about(normal) * local, T_MAX, light.power * (PI / local.z), 1.0);
}

float pdf_world(Light light, vec3 position, vec3 normal, vec3 to_light) {
    return pdf_cosine_hemisphere(dot(normal, to_light));
}

vec4 seen_world(Light light, vec3 origin, vec3 direction, float far) {
    return far >= T_MAX ? vec4(light.power, T_MAX) : vec4(0.0);
}

LightRay emit_world(Light light, vec2 u, vec2 on_light) {
    return emitted_by_surroundings(direction_from_versine(2.0 * u.x, 2.0 * PI * u.y), on_light, light.parameters.x);
}

vec3 flux_world(Light light) {
    float bounds = light.parameters.x;
    return light.power * (4.0 * PI * PI * bounds * bounds);
}
