// SPDX-License-Identifier: GPL-3.0-or-later
// Cycles' Noise Texture of any dimension (intern/cycles/kernel/svm/noisetex.h).
#include "lib/fractal.glsl"

// Seeds make one noise several: they shift it by 100 to 200 along each axis.
vec4 shift_of_seed(float seed, int dimensions) {
    if (dimensions == 1) return vec4(100.0 + 100.0 * hashed_1(seed), 0.0, 0.0, 0.0);
    vec4 shift = vec4(0.0);
    for (int axis = 0; axis < dimensions; ++axis) shift[axis] = 100.0 + 100.0 * hashed_2(vec2(seed, float(axis)));
    return shift;
}

// Of the operands that the nodes of all dimensions have.
Fractal fractal_of(vec4 octaves, vec4 shape, vec4 options) {
    float detail = clamp(octaves.y, 0.0, 15.0), roughness = max(octaves.z, 0.0);
    return Fractal(int(shape.w), options.x > 0.5, detail, roughness, octaves.w, shape.x, shape.y);
}

// The colour in xyz and the factor in w; without `coloured` the factor in all.
vec4 noise_texture(vec4 place, Fractal fractal, float distortion, bool coloured, int dimensions) {
    vec4 moved = place;
    int ways = distortion == 0.0 ? 0 : dimensions;
    for (int axis = 0; axis < ways; ++axis) {
        moved[axis] += distortion * signed_noise(place + shift_of_seed(float(axis), dimensions), dimensions);
    }
    vec3 colour;
    int channels = coloured ? 3 : 1;
    for (int channel = 0; channel < channels; ++channel) {
        vec4 shift = channel == 0 ? vec4(0.0) : shift_of_seed(float(dimensions + channel - 1), dimensions);
        colour[channel] = fractal_noise(moved + shift, fractal, dimensions);
    }
    return coloured ? vec4(colour, colour.x) : vec4(colour.x);
}
