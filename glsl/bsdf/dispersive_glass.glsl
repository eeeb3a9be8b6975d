// SPDX-License-Identifier: GPL-3.0-or-later
// Smooth glass that bends each wavelength differently, which is a delta lobe on both sides. As glass.glsl, but that
// ior is the index at Fraunhofer's line d; dispersion: 1 / Abbe number of the denser side, > 0 (lib/cauchy.glsl).
// Parameters: ior [by side], tint [rgb], reflects, open, dispersion.
// Traits: delta, transmits.
#include "lib/cauchy.glsl"
#include "lib/glass.glsl"

Glass dispersive_glass_of(Lobe lobe, Shape shape) {
    return unpack_glass(lobe.colour, 0.0, shape.parameters.y, shape.parameters.z);
}

vec3 pack_dispersive_glass(vec4 parameters, vec4 more) {
    return vec3(0.0, dispersed(parameters.x, more.z), pack_glass(parameters.yzw, more.x, 0.0, more.y));
}

Shape sided_dispersive_glass(Lobe lobe, Shape shape, float side) {
    return Shape(sided_parameters(shape.parameters, side), shape.weight);
}

bool transmits_dispersive_glass() { return true; }
bool disperses_dispersive_glass() { return true; }

vec3 eval_dispersive_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return vec3(0.0); }

float pdf_dispersive_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return 0.0; }

vec3 sample_dispersive_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    return sample_glass(dispersive_glass_of(lobe, shape), frame_about(normal), to_viewer, u, weight);
}

vec3 albedo_dispersive_glass(Lobe lobe, Shape shape, float cosine) {
    return albedo_glass(dispersive_glass_of(lobe, shape), cosine);
}

// Sends rays.
float roughness_dispersive_glass(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_dispersive_glass(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_glass(dispersive_glass_of(lobe, shape), from, to);
}
