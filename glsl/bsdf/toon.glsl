// SPDX-License-Identifier: GPL-3.0-or-later
// The diffuse component of Cycles' Toon BSDF: as bright wherever light is within a cone about the normal. It is not
// reciprocal. Colour: what it reflects of light from all of the cone.
// Parameters: size, edge.
#include "lib/toon.glsl"

vec3 pack_toon(vec4 parameters, vec4 more) { return vec3(parameters.xy, 0.0); }

bool is_diffuse_toon() { return true; }

bool is_softened_toon() { return true; }

bool is_about_shading_toon() { return true; }

vec3 eval_toon(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float nl = dot(normal, to_light);
    if (nl <= 0.0) return vec3(0.0);
    return lobe.colour * (brightness_of_toon(shape.parameters, nl) * density_of_toon(shape.parameters) / nl);
}

float pdf_toon(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return is_in_toon(shape.parameters, dot(normal, to_light)) ? density_of_toon(shape.parameters) : 0.0;
}

vec3 sample_toon(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = sample_cone_of_toon(shape.parameters, normal, u);
    float cosine = dot(normal, to_light);
    weight = cosine > 0.0 ? lobe.colour * brightness_of_toon(shape.parameters, cosine) : vec3(0.0);
    return to_light;
}

// No more than this.
vec3 albedo_toon(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

float roughness_toon(Lobe lobe, Shape shape) { return 1.0; }

// Photons go where the eye may be, not where light would come from.
float by_cosine_toon(Lobe lobe, Shape shape) { return 0.5; }

vec3 adjoint_toon(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
