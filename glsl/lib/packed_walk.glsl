// SPDX-License-Identifier: GPL-3.0-or-later
// What a walk below a surface depends on (bsdf/subsurface.glsl), in a number a channel: 9 bits of the radius, 8 of the
// albedo, and 7 of what else there is. As native/src/walks.rs reads it.
const float RADII = 511.0, ALBEDOS = 255.0, OTHERS = 127.0;
const float LEAST_RADIUS = 2.0e-6, OCTAVES = 21.0;  // [scene units], and how many there are from there on

// `others` are in [0, 1].
vec3 packed_walk(vec3 radius, vec3 albedo, vec3 others) {
    vec3 octaves = log2(max(radius, vec3(LEAST_RADIUS)) / LEAST_RADIUS) / OCTAVES;
    vec3 radii = floor(clamp(octaves, 0.0, 1.0) * RADII + 0.5), albedos = floor(clamp(albedo, 0.0, 1.0) * ALBEDOS + 0.5);
    return (radii * (ALBEDOS + 1.0) + albedos) * (OTHERS + 1.0) + floor(clamp(others, 0.0, 1.0) * OTHERS + 0.5);
}

// The mean free path [scene units]; 0 where light leaves at once.
vec3 radius_of_walk(vec3 walk) {
    vec3 octaves = floor(walk / ((ALBEDOS + 1.0) * (OTHERS + 1.0))) * (OCTAVES / RADII);
    return mix(LEAST_RADIUS * exp2(octaves), vec3(0.0), equal(octaves, vec3(0.0)));
}

vec3 albedo_of_walk(vec3 walk) {
    return max(mod(floor(walk / (OTHERS + 1.0)), ALBEDOS + 1.0), 1.0) / ALBEDOS;
}

// Alpha, index and what the next two tell.
vec3 others_of_walk(vec3 walk) { return mod(walk, OTHERS + 1.0) / OTHERS; }

// Whether half of the rays enter by the cosine.
bool is_by_cosine(vec3 walk) { return (int(mod(walk.z, OTHERS + 1.0)) & 1) != 0; }

// Whether the walk is Blender's since 5.2.
bool is_later_walk(vec3 walk) { return (int(mod(walk.z, OTHERS + 1.0)) & 2) != 0; }
