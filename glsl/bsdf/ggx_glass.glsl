// SPDX-License-Identifier: GPL-3.0-or-later
// Rough glass, on both sides. Colour: what refraction is multiplied by; ior: of the inside over the outside; tint:
// of the reflectance head-on; reflects: nothing (0), by Fresnel's formulae (1), or that times the colour (2).
// Open: a sheet, not the surface of a body (1), and as Cycles has it: see lib/glass.glsl.
// Parameters: alpha, compensated, ior [by side], tint [rgb], reflects, open.
// Traits: transmits, sends rays.
#include "lib/glass.glsl"

Glass ggx_glass_of(Lobe lobe, Shape shape) {
    return unpack_glass(lobe.colour, shape.parameters.x, shape.parameters.y, shape.parameters.z);
}

vec3 pack_ggx_glass(vec4 parameters, vec4 more) {
    return vec3(parameters.x, parameters.z, pack_glass(vec3(parameters.w, more.xy), more.z, parameters.y, more.w));
}

Shape sided_ggx_glass(Lobe lobe, Shape shape, float side) {
    return Shape(sided_parameters(shape.parameters, side), shape.weight);
}

bool transmits_ggx_glass() { return true; }

vec3 eval_ggx_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float density;
    return eval_glass(ggx_glass_of(lobe, shape), frame_about(normal), to_viewer, to_light, density);
}

float pdf_ggx_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float density;
    eval_glass(ggx_glass_of(lobe, shape), frame_about(normal), to_viewer, to_light, density);
    return density;
}

vec3 sample_ggx_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    return sample_glass(ggx_glass_of(lobe, shape), frame_about(normal), to_viewer, u, weight);
}

vec3 albedo_ggx_glass(Lobe lobe, Shape shape, float cosine) {
    return albedo_glass(ggx_glass_of(lobe, shape), cosine);
}

// Sends rays: photons about a point tell of its own side alone.
float roughness_ggx_glass(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_ggx_glass(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_glass(ggx_glass_of(lobe, shape), from, to);
}
