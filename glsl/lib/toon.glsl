// SPDX-License-Identifier: GPL-3.0-or-later
// Cones of even brightness, as Cycles' Toon BSDF has them: bright up to `size`, fading over `edge`, each of 90 degrees.
#include "lib/sampling.glsl"

// 1 - cos of the angle that samples fill.
float versine_of_toon(vec3 parameters) {
    float angle = min(0.5 * PI * (max(parameters.x, 1.0e-5) + parameters.y), 0.5 * PI);
    float sine = sin(0.5 * angle);
    return 2.0 * sine * sine;
}

// Per solid angle, of samples.
float density_of_toon(vec3 parameters) { return 0.5 / (PI * versine_of_toon(parameters)); }

bool is_in_toon(vec3 parameters, float cosine) { return 1.0 - cosine < versine_of_toon(parameters); }

// What is left of the brightness at an angle from the axis, of this cosine.
float brightness_of_toon(vec3 parameters, float cosine) {
    if (!is_in_toon(parameters, cosine)) return 0.0;  // at no more than a right angle
    float past = acos(clamp(cosine, 0.0, 1.0)) - 0.5 * PI * max(parameters.x, 1.0e-5);
    if (past < 0.0) return 1.0;
    float edge = 0.5 * PI * parameters.y;
    return past < edge ? 1.0 - past / edge : 0.0;
}

vec3 sample_cone_of_toon(vec3 parameters, vec3 axis, vec2 u) {
    return frame_about(axis) * direction_from_versine(u.x * versine_of_toon(parameters), 2.0 * PI * u.y);
}
