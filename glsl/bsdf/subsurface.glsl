// SPDX-License-Identifier: GPL-3.0-or-later
// Light that scatters below a surface, in a random walk from where the eye's ray enters to where it leaves, as Cycles
// has it: lib/random_walk.glsl. Colour: what comes out of a flat surface; albedo: the same, which the walk is made
// for; radius: the mean free path; entry: alpha of the microfacets that bend the ray as it enters, by the index, or 2:
// of half of the rays 1, and the others enter by the cosine. For photons, and where the eye's rays go no further, it
// is Lambert's lobe.
// Parameters: radius_r [m], radius_g [m], radius_b [m], entry, albedo [rgb], ior.
// Traits: delta.
#include "lib/ggx.glsl"

// A channel's number: 9 bits of the radius, 8 of the albedo, and 7 of what else there is.
const float RADII = 511.0, ALBEDOS = 255.0, OTHERS = 127.0;
const float LEAST_RADIUS = 2.0e-6, OCTAVES = 21.0;  // [scene units], and how many there are from there on
const float MOST_IOR = 3.8;

float pack_subsurface(float radius, float albedo, float other) {
    float octaves = log2(max(radius, LEAST_RADIUS) / LEAST_RADIUS) / OCTAVES;
    vec3 shares = clamp(vec3(octaves, albedo, other), 0.0, 1.0);
    vec3 steps = floor(shares * vec3(RADII, ALBEDOS, OTHERS) + 0.5);
    return (steps.x * (ALBEDOS + 1.0) + steps.y) * (OTHERS + 1.0) + steps.z;
}

vec3 pack_subsurface(vec4 parameters, vec4 more) {
    float ior = (more.w - 1.0) / (MOST_IOR - 1.0);
    return vec3(
        pack_subsurface(parameters.x, more.x, parameters.w),
        pack_subsurface(parameters.y, more.y, ior),
        pack_subsurface(parameters.z, more.z, float(parameters.w > 1.0))
    );
}

// 0 where light leaves at once.
vec3 radius_subsurface(Shape shape) {
    vec3 octaves = floor(shape.parameters / ((ALBEDOS + 1.0) * (OTHERS + 1.0))) * (OCTAVES / RADII);
    return mix(LEAST_RADIUS * exp2(octaves), vec3(0.0), equal(octaves, vec3(0.0)));
}

vec3 albedo_subsurface(Shape shape) {
    return max(mod(floor(shape.parameters / (OTHERS + 1.0)), ALBEDOS + 1.0), 1.0) / ALBEDOS;
}

vec3 eval_subsurface(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return vec3(0.0); }

float pdf_subsurface(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) { return 0.0; }

// The way in.
vec3 sample_subsurface(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 others = mod(shape.parameters, OTHERS + 1.0) / OTHERS;
    float inverse = 1.0 / (1.0 + others.y * (MOST_IOR - 1.0));
    mat3 frame = frame_about(normal);
    Ggx m = Ggx(GGX_CONSTANT, false, vec3(1.0), vec3(1.0), 1.0, vec2(others.x));
    vec2 apart = others.z > 0.0 ? vec2(2.0 * u.x - 1.0, u.y) : u;
    vec3 v = to_viewer * frame, h = sample_visible_normal(m, v, apart);
    float cosine = dot(h, v), through = sqrt(max(1.0 - inverse * inverse * (1.0 - cosine * cosine), 0.0));
    weight = lobe.colour;
    if (others.z > 0.0 && u.x < 0.5) return frame_about(-normal) * sample_cosine_hemisphere(vec2(2.0 * u.x, u.y));
    return frame * normalize((inverse * cosine - through) * h - inverse * v);
}

vec3 albedo_subsurface(Lobe lobe, Shape shape, float cosine) { return lobe.colour; }

bool is_diffuse_subsurface() { return true; }

// Sends rays.
float roughness_subsurface(Lobe lobe, Shape shape) { return 0.0; }

vec3 adjoint_subsurface(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }
