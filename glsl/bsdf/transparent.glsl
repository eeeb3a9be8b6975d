// SPDX-License-Identifier: GPL-3.0-or-later
// Light goes straight on, on both sides, as if nothing was there but a filter: a delta lobe. Colour: what is let
// through. Shadow rays ask for it as well (lib/transmittance.glsl).
// Parameters: none.
// Traits: delta, transmits.

vec3 pack_transparent(vec4 parameters, vec4 more) { return vec3(0.0); }

bool transmits_transparent() { return true; }

vec3 eval_transparent(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return vec3(0.0); }

float pdf_transparent(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return 0.0; }

vec3 sample_transparent(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    weight = lobe.colour;
    return -to_viewer;
}

vec3 albedo_transparent(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

float roughness_transparent(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_transparent(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
