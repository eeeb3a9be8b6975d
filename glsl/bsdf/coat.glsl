// SPDX-License-Identifier: GPL-3.0-or-later
// A clear coat, as Cycles' Principled BSDF has it: a dielectric's microfacets. Colour: the tint of what it lies over,
// seen head-on.
// Parameters: alpha, ior, cover.
#include "lib/coat_tint.glsl"
#include "lib/ggx.glsl"

// ior: at least 1; cover: the coat's weight, of all that it reflects and of its tint.
Ggx coat_of(Shape shape) {
    float alpha = shape.parameters.x, ior = shape.parameters.y;
    return Ggx(GGX_DIELECTRIC, true, vec3(f0_of_ior(ior)), vec3(1.0), ior, vec2(alpha));
}

vec3 pack_coat(vec4 parameters, vec4 more) { return parameters.xyz; }

vec3 eval_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return shape.parameters.z * eval_microfacets(coat_of(shape), frame_about(normal), to_viewer, to_light);
}

float pdf_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return pdf_microfacets(coat_of(shape), frame_about(normal), to_viewer, to_light);
}

vec3 sample_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = sample_microfacets(coat_of(shape), frame_about(normal), to_viewer, u, weight);
    weight *= shape.parameters.z;
    return to_light;
}

vec3 albedo_coat(Lobe lobe, Shape shape, float cosine) {
    return shape.parameters.z * albedo_microfacets(coat_of(shape), cosine);
}

float roughness_coat(Lobe lobe, Shape shape) { return sqrt(shape.parameters.x); }

float by_cosine_coat(Lobe lobe, Shape shape) { return share_by_cosine(sqrt(shape.parameters.x)); }

vec3 adjoint_coat(Lobe lobe, Shape shape, float from, float to) { return adjoint_ggx(coat_of(shape), from, to); }

vec3 transmittance_coat(Lobe lobe, Shape shape, float cosine, vec3 albedo) {
    float through = 1.0 - largest(albedo);
    return clamp(through, 0.0, 1.0) * transmittance_of_tint(lobe.colour, shape.parameters.y, shape.parameters.z, cosine);
}

Microfacets microfacets_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer) {
    Microfacets found = microfacets_of(coat_of(shape), vec2(shape.parameters.x, 0.0), normal, to_viewer);
    found.scale *= shape.parameters.z;
    return found;
}
