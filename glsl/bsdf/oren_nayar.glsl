// SPDX-License-Identifier: GPL-3.0-or-later
// Rough diffuse surfaces, as Cycles has them: Fujii's improved Oren-Nayar model, and what bounces between its facets,
// as OpenPBR gives it back. Colour: albedo of a facet, in [0, 1].
// Parameters: diffuse_roughness.
#include "lib/sampling.glsl"

// f = a + b t, before its colour; t is of the angle between the directions.
vec2 oren_nayar_of(Shape shape) {
    float a = 1.0 / (PI + shape.parameters.x * (0.5 * PI - 2.0 / 3.0));
    return vec2(a, shape.parameters.x * a);
}

// The integral of t times the cosine over the hemisphere.
float oren_nayar_towards(float c) {
    c = clamp(c, 0.0, 1.0);
    if (c < 1.0e-4) return 0.5 * PI - 2.0 / 3.0 - c;
    float s = sqrt(max(0.0, 1.0 - c * c));
    return s * (acos(c) - 2.0 / 3.0 - s * c) + 2.0 / 3.0 * (s / c) * (1.0 - s * s * s);
}

// Albedo of one bounce between white facets.
float single_oren_nayar(vec2 ab, float cosine) { return ab.x * PI + ab.y * oren_nayar_towards(cosine); }

float average_oren_nayar(vec2 ab) { return ab.x * PI + ab.y * (2.0 * PI - 5.6) / 3.0; }

// What several bounces add, over the colour and [1/sr] of what both directions lack of one.
vec3 several_oren_nayar(vec2 ab, vec3 colour) {
    float lacks = max(1.0e-7, 1.0 - average_oren_nayar(ab));
    return colour * colour * ((1.0 - lacks) / (PI * lacks)) / (1.0 - colour * lacks);
}

vec3 pack_oren_nayar(vec4 parameters, vec4 more) { return vec3(parameters.x, 0.0, 0.0); }

bool is_diffuse_oren_nayar() { return true; }

bool is_softened_oren_nayar() { return true; }

bool is_about_shading_oren_nayar() { return true; }

vec3 eval_oren_nayar(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float nv = max(0.0, dot(normal, to_viewer)), nl = dot(normal, to_light);
    if (nl <= 0.0) return vec3(0.0);
    vec2 ab = oren_nayar_of(shape);
    float t = dot(to_viewer, to_light) - nv * nl;
    if (t > 0.0) t /= max(nv, nl);
    float lacking = (1.0 - single_oren_nayar(ab, nv)) * (1.0 - single_oren_nayar(ab, nl));
    return lobe.colour * max(vec3(0.0), ab.x + ab.y * t + several_oren_nayar(ab, lobe.colour) * lacking);
}

float pdf_oren_nayar(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return pdf_cosine_hemisphere(dot(normal, to_light));
}

vec3 sample_oren_nayar(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = frame_about(normal) * sample_cosine_hemisphere(u);
    weight = PI * eval_oren_nayar(lobe, shape, normal, to_viewer, to_light);
    return to_light;
}

vec3 albedo_oren_nayar(Lobe lobe, Shape shape, float cosine) {
    vec2 ab = oren_nayar_of(shape);
    float single = single_oren_nayar(ab, cosine), lacks = 1.0 - average_oren_nayar(ab);
    return lobe.colour * (single + several_oren_nayar(ab, lobe.colour) * ((1.0 - single) * lacks * PI));
}

float roughness_oren_nayar(Lobe lobe, Shape shape) { return 1.0; }

float by_cosine_oren_nayar(Lobe lobe, Shape shape) { return 1.0; }

vec3 adjoint_oren_nayar(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
