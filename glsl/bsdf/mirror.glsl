// SPDX-License-Identifier: GPL-3.0-or-later
// A perfect mirror. Colour: its reflectance.
// Parameters: none.
// Traits: delta.

vec3 pack_mirror(vec4 parameters, vec4 more) { return vec3(0.0); }

vec3 eval_mirror(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return vec3(0.0); }

float pdf_mirror(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return 0.0; }

vec3 sample_mirror(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    weight = lobe.colour;
    return reflect(-to_viewer, normal);
}

vec3 albedo_mirror(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

float roughness_mirror(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_mirror(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
