// SPDX-License-Identifier: GPL-3.0-or-later
// Rough glass that bends each wavelength differently, on both sides. As ggx_glass.glsl, but that ior is the index at
// Fraunhofer's line d, and switches are twice what it reflects and 1 if it is compensated; dispersion: 1 / Abbe number
// of the denser side, > 0 (lib/cauchy.glsl).
// Parameters: alpha, switches, ior [by side], tint [rgb], open, dispersion.
// Traits: transmits, sends rays.
#include "lib/cauchy.glsl"
#include "lib/glass.glsl"

Glass ggx_dispersive_glass_of(Lobe lobe, Shape shape) {
    return unpack_glass(lobe.colour, shape.parameters.x, shape.parameters.y, shape.parameters.z);
}

vec3 pack_ggx_dispersive_glass(vec4 parameters, vec4 more) {
    float reflects = floor(0.5 * parameters.y), compensated = parameters.y - 2.0 * reflects;
    float code = pack_glass(vec3(parameters.w, more.xy), reflects, compensated, more.z);
    return vec3(parameters.x, dispersed(parameters.z, more.w), code);
}

Shape sided_ggx_dispersive_glass(Lobe lobe, Shape shape, float side) {
    return Shape(sided_parameters(shape.parameters, side), shape.weight);
}

bool transmits_ggx_dispersive_glass() { return true; }
bool disperses_ggx_dispersive_glass() { return true; }

vec3 eval_ggx_dispersive_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float density;
    return eval_glass(ggx_dispersive_glass_of(lobe, shape), frame_about(normal), to_viewer, to_light, density);
}

float pdf_ggx_dispersive_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float density;
    eval_glass(ggx_dispersive_glass_of(lobe, shape), frame_about(normal), to_viewer, to_light, density);
    return density;
}

vec3 sample_ggx_dispersive_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    return sample_glass(ggx_dispersive_glass_of(lobe, shape), frame_about(normal), to_viewer, u, weight);
}

vec3 albedo_ggx_dispersive_glass(Lobe lobe, Shape shape, float cosine) {
    return albedo_glass(ggx_dispersive_glass_of(lobe, shape), cosine);
}

// Sends rays: photons about a point tell of its own side alone.
float roughness_ggx_dispersive_glass(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_ggx_dispersive_glass(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_glass(ggx_dispersive_glass_of(lobe, shape), from, to);
}
