// SPDX-License-Identifier: GPL-3.0-or-later
// Microfacets of one reflectance at every angle, as Cycles' Glossy BSDF has them. Colour: that reflectance. The
// formulae of all kinds of microfacets: lib/ggx.glsl.
// Parameters: alpha_x, alpha_y, turn, compensated.
#include "lib/ggx.glsl"

Ggx ggx_of(Lobe lobe, Shape shape, vec3 normal, out mat3 frame) {
    Ggx m = unpack_ggx_shape(GGX_CONSTANT, lobe.colour, shape.parameters.xy, normal, frame);
    return m;
}

vec3 pack_ggx(vec4 parameters, vec4 more) {
    return vec3(pack_ggx_shape(parameters.x, parameters.y, parameters.z, parameters.w), 0.0);
}

vec3 eval_ggx(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    mat3 frame;
    Ggx m = ggx_of(lobe, shape, normal, frame);
    return eval_microfacets(m, frame, to_viewer, to_light);
}

float pdf_ggx(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    mat3 frame;
    Ggx m = ggx_of(lobe, shape, normal, frame);
    return pdf_microfacets(m, frame, to_viewer, to_light);
}

vec3 sample_ggx(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    mat3 frame;
    Ggx m = ggx_of(lobe, shape, normal, frame);
    return sample_microfacets(m, frame, to_viewer, u, weight);
}

vec3 albedo_ggx(Lobe lobe, Shape shape, float cosine) {
    mat3 frame;
    return albedo_microfacets(ggx_of(lobe, shape, vec3(0.0, 0.0, 1.0), frame), cosine);
}

float roughness_ggx(Lobe lobe, Shape shape) { return least_ggx_roughness(shape.parameters.xy); }

float by_cosine_ggx(Lobe lobe, Shape shape) { return share_by_cosine_ggx(shape.parameters.xy); }

vec3 adjoint_ggx(Lobe lobe, Shape shape, float from, float to) {
    mat3 frame;
    return adjoint_ggx(ggx_of(lobe, shape, vec3(0.0, 0.0, 1.0), frame), from, to);
}

Shape turned_ggx(Lobe lobe, Shape shape, float angle) {
    return Shape(vec3(turned_ggx_shape(shape.parameters.xy, angle), shape.parameters.z), shape.weight);
}

Microfacets microfacets_ggx(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer) {
    mat3 frame;
    return microfacets_of(ggx_of(lobe, shape, normal, frame), shape.parameters.xy, normal, to_viewer);
}
