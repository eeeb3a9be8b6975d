// SPDX-License-Identifier: GPL-3.0-or-later
// Phong's lobe, as the paper has it, by Lafortune & Willems 1994: (n + 2) / (2 PI) cos^n(alpha) about the
// mirrored direction, reciprocal. Colour: its reflectance k_s at most.
// Parameters: exponent.
#include "lib/sampling.glsl"

vec3 pack_phong(vec4 parameters, vec4 more) { return vec3(parameters.x, 0.0, 0.0); }

vec3 eval_phong(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float exponent = shape.parameters.x;
    float cosine = dot(reflect(-to_light, normal), to_viewer);
    // Also for an exponent of 0, where pow(0, 0) is undefined: sample_phong sends nothing there.
    if (!(cosine > 0.0)) return vec3(0.0);
    return lobe.colour * ((exponent + 2.0) / (2.0 * PI) * pow(cosine, exponent));
}

float pdf_phong(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float cosine = dot(reflect(-to_light, normal), to_viewer);
    if (!(cosine > 0.0)) return 0.0;
    return (shape.parameters.x + 1.0) / (2.0 * PI) * pow(cosine, shape.parameters.x);
}

vec3 sample_phong(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    float exponent = shape.parameters.x;
    // 1 - u^(1/(n+1)) through expm1-like care is not needed: n <= 1e6 keeps 1 - cos above 1e-9
    float cosine = pow(1.0 - u.x, 1.0 / (exponent + 1.0));
    vec3 mirrored = reflect(-to_viewer, normal);
    vec3 to_light = frame_about(mirrored) * direction_from_versine(1.0 - cosine, 2.0 * PI * u.y);
    weight = lobe.colour * ((exponent + 2.0) / (exponent + 1.0) * max(0.0, dot(to_light, normal)));
    return to_light;
}

// No more than this: what would go below the surface is lost.
vec3 albedo_phong(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

// Of microfacets about as broad.
float roughness_phong(Lobe lobe, Shape shape) { return sqrt(sqrt(2.0 / (shape.parameters.x + 2.0))); }

vec3 adjoint_phong(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
