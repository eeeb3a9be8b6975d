// SPDX-License-Identifier: GPL-3.0-or-later
// The glossy component of Cycles' Toon BSDF: as bright wherever light is within a cone about the mirrored direction.
// Colour: what it reflects of light from all of the cone.
// Parameters: size, edge.
#include "lib/toon.glsl"

vec3 pack_glossy_toon(vec4 parameters, vec4 more) { return vec3(parameters.xy, 0.0); }

bool is_about_shading_glossy_toon() { return true; }

vec3 eval_glossy_toon(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float nl = dot(normal, to_light);
    if (nl <= 0.0) return vec3(0.0);
    float bright = brightness_of_toon(shape.parameters, dot(reflect(-to_viewer, normal), to_light));
    return lobe.colour * (bright * density_of_toon(shape.parameters) / nl);
}

float pdf_glossy_toon(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    float cosine = dot(reflect(-to_viewer, normal), to_light);
    return is_in_toon(shape.parameters, cosine) ? density_of_toon(shape.parameters) : 0.0;
}

vec3 sample_glossy_toon(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 mirrored = reflect(-to_viewer, normal);
    vec3 to_light = sample_cone_of_toon(shape.parameters, mirrored, u);
    float bright = brightness_of_toon(shape.parameters, dot(mirrored, to_light));
    weight = dot(normal, to_light) > 0.0 ? lobe.colour * bright : vec3(0.0);
    return to_light;
}

// No more than this: what would go below the surface is lost.
vec3 albedo_glossy_toon(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

// Gathers photons: its edges are those of lights.
float roughness_glossy_toon(Lobe lobe, Shape shape) { return 1.0; }

float by_cosine_glossy_toon(Lobe lobe, Shape shape) { return 0.5; }

vec3 adjoint_glossy_toon(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
