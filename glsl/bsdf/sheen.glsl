// SPDX-License-Identifier: GPL-3.0-or-later
// Sheen of fibres, as Cycles' Principled and Sheen BSDF have it. Colour: its tint, in [0, 1].
// Parameters: roughness.
#include "lib/sheen.glsl"

vec3 pack_sheen(vec4 parameters, vec4 more) { return vec3(parameters.x, 0.0, 0.0); }

bool is_diffuse_sheen() { return true; }

bool is_softened_sheen() { return true; }

bool is_about_shading_sheen() { return true; }

Sheen sheen_towards(Shape shape, vec3 normal, vec3 to_viewer) {
    return sheen_of(clamp(dot(normal, to_viewer), 0.0, 1.0), shape.parameters.x);
}

vec3 eval_sheen(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    if (dot(normal, to_light) <= 0.0) return vec3(0.0);
    Sheen s = sheen_towards(shape, normal, to_viewer);
    return lobe.colour * (s.albedo * sheen_density(s, to_light * sheen_frame(normal, to_viewer)));
}

float pdf_sheen(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float cosine = dot(normal, to_light);
    if (cosine <= 0.0) return 0.0;
    Sheen s = sheen_towards(shape, normal, to_viewer);
    return cosine * sheen_density(s, to_light * sheen_frame(normal, to_viewer));
}

vec3 sample_sheen(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    Sheen s = sheen_towards(shape, normal, to_viewer);
    vec3 c = sample_cosine_hemisphere(u);
    vec3 to_light = sheen_frame(normal, to_viewer) * normalize(vec3(c.x - c.z * s.b, c.y, c.z * s.a));
    weight = dot(normal, to_light) > 0.0 ? lobe.colour * s.albedo : vec3(0.0);
    return to_light;
}

vec3 albedo_sheen(Lobe lobe, Shape shape, float cosine) {
    return lobe.colour * sheen_of(clamp(cosine, 0.0, 1.0), shape.parameters.x).albedo;
}

float roughness_sheen(Lobe lobe, Shape shape) { return shape.parameters.x; }

// It is not reciprocal: photons leave where it is bright to the viewer.
float by_cosine_sheen(Lobe lobe, Shape shape) { return 0.5; }

vec3 adjoint_sheen(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
