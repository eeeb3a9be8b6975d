// SPDX-License-Identifier: GPL-3.0-or-later
// A clear coat (coat.glsl) about a normal of its own, in scene space. Colour: the tint of what it lies over, seen
// head-on.
// Parameters: alpha, ior, cover, normal_x, normal_y, normal_z.
// Traits: sends rays.
#include "lib/coat_tint.glsl"
#include "lib/ggx.glsl"
#include "lib/packing.glsl"

const float STEPS = 4094.0;  // even, so that axes and halves are exact

// normal_x to normal_z: from 0 to 1, half of the normal and a half. Roughness and cover are kept to 12 bits.
vec3 pack_bent_coat(vec4 parameters, vec4 more) {
    vec2 q = floor(vec2(sqrt(min(parameters.x, 1.0)), min(parameters.z, 1.0)) * STEPS + 0.5);
    vec3 normal = 2.0 * vec3(parameters.w, more.xy) - 1.0;
    return vec3(q.x * 4096.0 + q.y, parameters.y, pack_octahedral(dot(normal, normal) > 0.0 ? normal : vec3(0.0, 0.0, 1.0), STEPS));
}

float roughness_of_bent_coat(Shape shape) { return floor(shape.parameters.x / 4096.0) / STEPS; }

// It gathers no photons: they are gathered about the surface's normal, and coats are sharp.
float roughness_bent_coat(Lobe lobe, Shape shape) { return 0.0; }

float cover_of_bent_coat(Shape shape) { return mod(shape.parameters.x, 4096.0) / STEPS; }

Ggx bent_coat_of(Lobe lobe, Shape shape) {
    float roughness = roughness_of_bent_coat(shape), ior = shape.parameters.y;
    return Ggx(GGX_DIELECTRIC, true, vec3(f0_of_ior(ior)), vec3(1.0), ior, vec2(roughness * roughness));
}

vec3 own_normal_bent_coat(Lobe lobe, Shape shape) { return normalize(unpack_octahedral(shape.parameters.z, STEPS)); }

vec3 eval_bent_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    Ggx coat = bent_coat_of(lobe, shape);
    return cover_of_bent_coat(shape) * eval_microfacets(coat, frame_about(normal), to_viewer, to_light);
}

float pdf_bent_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return pdf_microfacets(bent_coat_of(lobe, shape), frame_about(normal), to_viewer, to_light);
}

vec3 sample_bent_coat(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = sample_microfacets(bent_coat_of(lobe, shape), frame_about(normal), to_viewer, u, weight);
    weight *= cover_of_bent_coat(shape);
    return to_light;
}

vec3 albedo_bent_coat(Lobe lobe, Shape shape, float cosine) {
    return cover_of_bent_coat(shape) * albedo_microfacets(bent_coat_of(lobe, shape), cosine);
}

float by_cosine_bent_coat(Lobe lobe, Shape shape) { return share_by_cosine(roughness_of_bent_coat(shape)); }

vec3 adjoint_bent_coat(Lobe lobe, Shape shape, float from, float to) {
    return adjoint_ggx(bent_coat_of(lobe, shape), from, to);
}

vec3 transmittance_bent_coat(Lobe lobe, Shape shape, float cosine, vec3 albedo) {
    float cover = cover_of_bent_coat(shape), through = clamp(1.0 - largest(albedo), 0.0, 1.0);
    return transmittance_of_tint(lobe.colour, shape.parameters.y, cover, cosine) * through;
}
