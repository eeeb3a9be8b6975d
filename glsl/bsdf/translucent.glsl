// SPDX-License-Identifier: GPL-3.0-or-later
// A thin sheet that scatters what falls on it, on both sides, evenly over the other one. Colour: how much of it.
// Parameters: none.
// Traits: transmits, sends rays.
#include "lib/sampling.glsl"

vec3 pack_translucent(vec4 parameters, vec4 more) { return vec3(0.0); }

bool transmits_translucent() { return true; }

bool is_diffuse_translucent() { return true; }

bool is_softened_translucent() { return true; }

vec3 eval_translucent(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    bool is_through = dot(normal, to_viewer) > 0.0 && dot(normal, to_light) < 0.0;
    return is_through ? lobe.colour / PI : vec3(0.0);
}

float pdf_translucent(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return pdf_cosine_hemisphere(-dot(normal, to_light));
}

vec3 sample_translucent(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    weight = lobe.colour;
    return frame_about(-normal) * sample_cosine_hemisphere(u);
}

vec3 albedo_translucent(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

// Sends rays: photons about a point tell of its own side alone.
float roughness_translucent(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_translucent(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
