// SPDX-License-Identifier: GPL-3.0-or-later
// Light that scatters below a surface, in a random walk from where the eye's ray enters to where it leaves, as Cycles
// has it: lib/random_walk.glsl. Colour: what comes out of a flat surface; albedo: the same, which the walk is made
// for; radius: the mean free path; entry: alpha of the microfacets that bend the ray as it enters, by the index, or 2:
// of half of the rays 1, and the others enter by the cosine; and 4 more where the walk is Blender's since 5.2. For
// photons, and where the eye's rays go no further, it is Lambert's lobe.
// Parameters: radius_r [m], radius_g [m], radius_b [m], entry, albedo [rgb], ior.
// Traits: delta.
#include "lib/ggx.glsl"
#include "lib/packed_walk.glsl"

const float MOST_IOR = 3.8;

vec3 pack_subsurface(vec4 parameters, vec4 more) {
    float ior = (more.w - 1.0) / (MOST_IOR - 1.0);
    float later = float(parameters.w >= 4.0), entry = parameters.w - 4.0 * later;
    vec3 others = vec3(entry, ior, (2.0 * later + float(entry > 1.0)) / OTHERS);
    return packed_walk(parameters.xyz, more.xyz, others);
}

vec3 eval_subsurface(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return vec3(0.0); }

float pdf_subsurface(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return 0.0; }

// The way in.
vec3 sample_subsurface(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 others = others_of_walk(shape.parameters);
    float inverse = 1.0 / (1.0 + others.y * (MOST_IOR - 1.0));
    mat3 frame = frame_about(normal);
    Ggx m = Ggx(GGX_CONSTANT, false, vec3(1.0), vec3(1.0), 1.0, vec2(others.x));
    bool by_cosine = is_by_cosine(shape.parameters);
    vec2 apart = by_cosine ? vec2(2.0 * u.x - 1.0, u.y) : u;
    vec3 v = to_viewer * frame, h = sample_visible_normal(m, v, apart);
    float cosine = dot(h, v), through = sqrt(max(1.0 - inverse * inverse * (1.0 - cosine * cosine), 0.0));
    weight = lobe.colour;
    if (by_cosine && u.x < 0.5) return frame_about(-normal) * sample_cosine_hemisphere(vec2(2.0 * u.x, u.y));
    return frame * normalize((inverse * cosine - through) * h - inverse * v);
}

vec3 albedo_subsurface(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

bool is_diffuse_subsurface() { return true; }

// Sends rays.
float roughness_subsurface(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_subsurface(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
