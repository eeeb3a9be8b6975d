// SPDX-License-Identifier: GPL-3.0-or-later
// Lobes besides Lambert's, whatever their kind: made/bsdf.glsl has those of the scene. Directions are unit
// vectors away from the surface; weights are f cos / pdf. A lobe of kind 0 is none, and reflects nothing.
#include "lib/colour.glsl"
#include "made/bsdf.glsl"

bool is_lobe(Lobe lobe) { return lobe.kind > 0.0; }

// BSDF [1/sr]; mirrors reflect no delta light.
vec3 eval_lobe(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return shape.weight * eval_kind(lobe, shape, normal, to_viewer, to_light);
}

// A direction to the light, with the density of the lobe, and what it weighs.
vec3 sample_lobe(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = sample_kind(lobe, shape, normal, to_viewer, u, weight);
    weight *= shape.weight;
    return to_light;
}

// What it reflects of the light from everywhere to a viewer at this cosine, no more than 1.
vec3 albedo_lobe(Lobe lobe, Shape shape, float cosine) { return shape.weight * albedo_kind(lobe, shape, cosine); }

// The share of light that gets through it, to and fro, to what it lies over, as Cycles layers closures: by
// the viewer's direction alone, and the same for all colours. That is not reciprocal: whoever goes from the
// light to the eye has to ask for the direction that leads on to the eye.
float passed_by_lobe(Lobe lobe, Shape shape, float cosine) {
    return clamp(1.0 - largest(albedo_kind(lobe, shape, cosine)), 0.0, 1.0);
}
