// SPDX-License-Identifier: GPL-3.0-or-later
// Ashikhmin's velvet, as Cycles' Sheen BSDF has it: facets that lean towards the horizon. Colour: what each reflects.
// Parameters: sigma.
#include "lib/sampling.glsl"

vec3 pack_velvet(vec4 parameters, vec4 more) { return vec3(parameters.x, 0.0, 0.0); }

bool is_diffuse_velvet() { return true; }

bool is_about_shading_velvet() { return true; }

vec3 eval_velvet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float nv = dot(normal, to_viewer), nl = dot(normal, to_light);
    vec3 h = to_viewer + to_light;
    float h2 = dot(h, h);
    if (nv <= 0.0 || nl <= 0.0 || h2 < 1.0e-12) return vec3(0.0);
    h *= inversesqrt(h2);
    float nh = dot(normal, h), vh = 0.5 * sqrt(h2), sigma = max(shape.parameters.x, 0.01);
    if (nh >= 1.0 - 1.0e-5 || vh <= 1.0e-5) return vec3(0.0);
    vec3 across = cross(normal, h);
    float sine2 = dot(across, across), inverse2 = 1.0 / (sigma * sigma);
    float density = exp(-nh * nh / sine2 * inverse2) * inverse2 / (PI * sine2 * sine2);
    float seen = min(1.0, 2.0 * max(nh / vh, 1.0e-5) * min(nv, nl));
    return lobe.colour * (0.25 * density * seen / (nv * nl));
}

float pdf_velvet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return pdf_cosine_hemisphere(dot(normal, to_light));
}

vec3 sample_velvet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = frame_about(normal) * sample_cosine_hemisphere(u);
    weight = PI * eval_velvet(lobe, shape, normal, to_viewer, to_light);
    return to_light;
}

// No more than this.
vec3 albedo_velvet(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

float roughness_velvet(Lobe lobe, Shape shape) { return 1.0; }

float by_cosine_velvet(Lobe lobe, Shape shape) { return 1.0; }

vec3 adjoint_velvet(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
