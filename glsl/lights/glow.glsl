// SPDX-License-Identifier: GPL-3.0-or-later
// What a medium emits about a place: a ball that emits evenly all through, which hides nothing. No ray meets it, for rays
// find what media emit on their way (lib/glow.glsl).
// Parameters: radius [m], surface. Power: W.

// A third number of two that are drawn evenly, which goes round many times with each of them.
float third_of(vec2 u) { return fract(dot(u, vec2(97.0, 61.0))); }

// A direction uniform in the cone that the ball fills, in it one of all; and a place anywhere on the way through.
LightSample sample_glow(Light light, vec3 position, vec3 normal, vec2 u) {
    float radius2 = light.parameters.x * light.parameters.x;
    vec3 to_middle = light.position - position;
    float distance2 = dot(to_middle, to_middle), sine2 = radius2 / max(distance2, radius2);
    bool is_inside = distance2 <= radius2;
    float widest = is_inside ? 2.0 : sine2 / (1.0 + sqrt(1.0 - sine2)), versine = u.x * widest;
    vec3 axis = distance2 > 0.0 ? to_middle * inversesqrt(distance2) : normal;
    float middle = sqrt(distance2) * (1.0 - versine), beside2 = distance2 * versine * (2.0 - versine);
    float half_chord = sqrt(max(radius2 - beside2, 0.0));
    float enters = is_inside ? 0.0 : middle - half_chord, leaves = middle + half_chord;
    // Of the power, what a length of it adds to radiance: 1 / (4 PI) over its volume.
    vec3 emission = light.power * (3.0 / (16.0 * PI * PI * radius2 * light.parameters.x));
    vec3 direction = frame_about(axis) * direction_from_versine(versine, 2.0 * PI * u.y);
    return LightSample(direction, mix(enters, leaves, third_of(u)), emission * ((leaves - enters) * 2.0 * PI * widest), 1.0);
}

float pdf_glow(Light light, vec3 position, vec3 normal, vec3 to_light) { return 0.0; }  // no other ray finds it

vec4 seen_glow(Light light, vec3 origin, vec3 direction, float far) { return vec4(0.0); }

// From anywhere on a way through the ball, more often of a long one.
LightRay emit_glow(Light light, vec2 u, vec2 on_light) {
    vec3 direction = about_axis(light, 2.0 * u.x, u.y);
    vec2 disc = sample_disc(on_light);
    float part = min(dot(disc, disc), 1.0);
    if (part > 0.0) disc *= sqrt((1.0 - pow(1.0 - part, 2.0 / 3.0)) / part);
    float along = sqrt(max(1.0 - dot(disc, disc), 0.0)) * (2.0 * third_of(on_light) - 1.0);
    return LightRay(light.position + frame_about(direction) * (vec3(disc, along) * light.parameters.x), direction, 1.0);
}

LightBounds bounds_glow(Light light) { return sphere_bounds(light, light.parameters.x, ALL_AROUND); }

vec3 flux_glow(Light light) { return light.power; }
