// SPDX-License-Identifier: GPL-3.0-or-later
// What goes through a sheet of rough glass, as Cycles has it: what microfacets would reflect, on the other side. Colour:
// how much of it. The formulae: lib/ggx.glsl. What is lost between microfacets is given back.
// Parameters: alpha.
// Traits: transmits, sends rays.
#include "lib/ggx.glsl"
#include "lib/sampling.glsl"

Ggx ggx_sheet_of(Lobe lobe, Shape shape) {
    return Ggx(GGX_CONSTANT, true, lobe.colour, vec3(1.0), 1.0, vec2(shape.parameters.x));
}

vec3 on_other_side(vec3 direction, vec3 normal) { return direction - 2.0 * dot(direction, normal) * normal; }

vec3 pack_ggx_sheet(vec4 parameters, vec4 more) { return vec3(parameters.x, 0.0, 0.0); }

bool transmits_ggx_sheet() { return true; }

vec3 eval_ggx_sheet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    Ggx m = ggx_sheet_of(lobe, shape);
    return eval_microfacets(m, frame_about(-normal), on_other_side(to_viewer, normal), to_light);
}

float pdf_ggx_sheet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    Ggx m = ggx_sheet_of(lobe, shape);
    return pdf_microfacets(m, frame_about(-normal), on_other_side(to_viewer, normal), to_light);
}

vec3 sample_ggx_sheet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    Ggx m = ggx_sheet_of(lobe, shape);
    return sample_microfacets(m, frame_about(-normal), on_other_side(to_viewer, normal), u, weight);
}

vec3 albedo_ggx_sheet(Lobe lobe, Shape shape, float cosine) {
    return albedo_microfacets(ggx_sheet_of(lobe, shape), cosine);
}

// Sends rays: photons about a point tell of its own side alone.
float roughness_ggx_sheet(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_ggx_sheet(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_ggx(ggx_sheet_of(lobe, shape), from, to);
}
