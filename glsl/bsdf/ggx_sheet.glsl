// SPDX-License-Identifier: GPL-3.0-or-later
// A sheet of rough glass, as Cycles has it: what microfacets that reflect all light send on, on the side that it came from
// (through: 0) or on the other (1). Colour: how much of it. The formulae: lib/ggx.glsl, with what is lost between
// microfacets given back.
// Parameters: alpha, through.
// Traits: transmits, sends rays.
#include "lib/ggx.glsl"
#include "lib/sampling.glsl"

Ggx ggx_sheet_of(Shape shape) { return Ggx(GGX_CONSTANT, true, vec3(1.0), vec3(1.0), 1.0, vec2(shape.parameters.x)); }

bool is_through_sheet(Shape shape) { return shape.parameters.y > 0.5; }

mat3 frame_of_sheet(Shape shape, vec3 normal) { return frame_about(is_through_sheet(shape) ? -normal : normal); }

// The viewer on the side where light leaves.
vec3 viewer_of_sheet(Shape shape, vec3 to_viewer, vec3 normal) {
    return is_through_sheet(shape) ? to_viewer - 2.0 * dot(to_viewer, normal) * normal : to_viewer;
}

vec3 pack_ggx_sheet(vec4 parameters, vec4 more) { return vec3(parameters.xy, 0.0); }

bool transmits_ggx_sheet() { return true; }

vec3 eval_ggx_sheet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    vec3 viewer = viewer_of_sheet(shape, to_viewer, normal);
    return lobe.colour * eval_microfacets(ggx_sheet_of(shape), frame_of_sheet(shape, normal), viewer, to_light);
}

float pdf_ggx_sheet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    vec3 viewer = viewer_of_sheet(shape, to_viewer, normal);
    return pdf_microfacets(ggx_sheet_of(shape), frame_of_sheet(shape, normal), viewer, to_light);
}

vec3 sample_ggx_sheet(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 viewer = viewer_of_sheet(shape, to_viewer, normal);
    vec3 outgoing = sample_microfacets(ggx_sheet_of(shape), frame_of_sheet(shape, normal), viewer, u, weight);
    weight *= lobe.colour;
    return outgoing;
}

vec3 albedo_ggx_sheet(Lobe lobe, Shape shape, float cosine) {
    return lobe.colour * albedo_microfacets(ggx_sheet_of(shape), cosine);
}

// Sends rays: photons about a point tell of its own side alone.
float roughness_ggx_sheet(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_ggx_sheet(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_ggx(ggx_sheet_of(shape), abs(from), abs(to));
}
