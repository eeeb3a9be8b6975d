// SPDX-License-Identifier: GPL-3.0-or-later
// A medium's phase function by Henyey & Greenstein 1941, as the lobe of a point (lib/scattering_point.glsl). There is no
// surface: its values are over the cosine to the normal that all lobes are multiplied by. Colour: what is not absorbed.
// Parameters: anisotropy.
// Traits: sends rays, in media.
#include "lib/sampling.glsl"

vec3 pack_phase(vec4 parameters, vec4 more) { return vec3(parameters.x, 0.0, 0.0); }

// To surfaces its rays are diffuse ones.
bool is_diffuse_phase() { return true; }

bool is_about_shading_phase() { return true; }

// [1/sr], of the cosine between where light comes from and goes on to.
float henyey_greenstein(float g, float cosine) {
    float root = max(1.0 + g * g - 2.0 * g * cosine, 1.0e-7);
    return (1.0 - g * g) / (4.0 * PI * root * sqrt(root));
}

float pdf_phase(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return henyey_greenstein(shape.parameters.x, -dot(to_viewer, to_light));
}

vec3 eval_phase(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float cosine = max(abs(dot(normal, to_light)), 1.0e-6);
    return lobe.colour * (pdf_phase(lobe, shape, normal, to_viewer, to_light) / cosine);
}

vec3 sample_phase(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    float g = shape.parameters.x, versine = 2.0 * u.x;  // 1 - the cosine to straight on
    if (abs(g) > 1.0e-3) {
        float below = 1.0 - g + 2.0 * g * (1.0 - u.x), part = (1.0 - g * g) / below;
        versine = 1.0 - clamp((1.0 + g * g - part * part) / (2.0 * g), -1.0, 1.0);
    }
    weight = lobe.colour;
    return frame_about(-to_viewer) * direction_from_versine(versine, 2.0 * PI * u.y);
}

vec3 albedo_phase(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

// Sends rays: photons land on surfaces alone.
float roughness_phase(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_phase(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
