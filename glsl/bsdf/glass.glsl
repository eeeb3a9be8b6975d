// SPDX-License-Identifier: GPL-3.0-or-later
// Smooth glass, which is a delta lobe on both sides. Colour: what refraction is multiplied by; ior: of the inside
// over the outside; tint: of the reflectance head-on; reflects: nothing (0), by Fresnel's formulae (1), or that
// times the colour (2).
// Open: a sheet, not the surface of a body (1), and as Cycles has it: see lib/glass.glsl.
// Parameters: ior [by side], tint [rgb], reflects, open.
// Traits: delta, transmits.
#include "lib/glass.glsl"

Glass glass_of(Lobe lobe, Shape shape) {
    return unpack_glass(lobe.colour, 0.0, shape.parameters.y, shape.parameters.z);
}

vec3 pack_glass(vec4 parameters, vec4 more) {
    return vec3(0.0, parameters.x, pack_glass(parameters.yzw, more.x, 0.0, more.y));
}

Shape sided_glass(Lobe lobe, Shape shape, float side) {
    return Shape(sided_parameters(shape.parameters, side), shape.weight);
}

bool transmits_glass() { return true; }

vec3 eval_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return vec3(0.0); }

float pdf_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return 0.0; }

vec3 sample_glass(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    return sample_glass(glass_of(lobe, shape), frame_about(normal), to_viewer, u, weight);
}

vec3 albedo_glass(Lobe lobe, Shape shape, float cosine) { return albedo_glass(glass_of(lobe, shape), cosine); }

// Sends rays.
float roughness_glass(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_glass(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_glass(glass_of(lobe, shape), from, to);
}
