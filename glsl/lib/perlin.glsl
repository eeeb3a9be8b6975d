// SPDX-License-Identifier: GPL-3.0-or-later
// Perlin 2002, "Improving Noise", of one to four dimensions, with the hashes, the gradients and the scales of Cycles'.
// `dimensions` is a constant wherever it is called, so a program holds the dimensions that it asks for. Corners are a
// loop: unrolled ones take software OpenGL long to compile. It ends where it asks, for one that asks first runs through
// there once more for nothing.
#include "lib/jenkins.glsl"

float signed_by(float value, uint bit) { return bit == 0u ? value : -value; }

float along_gradient(uvec4 corner, vec4 to, int dimensions) {
    if (dimensions == 1) {
        uint hash = hash_1(corner.x);
        return signed_by(float(1u + (hash & 7u)), hash & 8u) * to.x;
    }
    if (dimensions == 2) {
        uint hash = hash_2(corner.xy) & 7u;
        vec2 ordered = hash < 4u ? to.xy : to.yx;
        return signed_by(ordered.x, hash & 1u) + signed_by(2.0 * ordered.y, hash & 2u);
    }
    if (dimensions == 3) {
        uint hash = hash_3(corner.xyz) & 15u;
        float first = hash < 8u ? to.x : to.y;
        float second = hash < 4u ? to.y : (hash == 12u || hash == 14u ? to.x : to.z);
        return signed_by(first, hash & 1u) + signed_by(second, hash & 2u);
    }
    uint hash = hash_4(corner) & 31u;
    float first = hash < 24u ? to.x : to.y, second = hash < 16u ? to.y : to.z, third = hash < 8u ? to.z : to.w;
    return signed_by(first, hash & 1u) + signed_by(second, hash & 2u) + signed_by(third, hash & 4u);
}

float perlin(vec4 place, int dimensions) {
    vec4 cell = floor(place), within = place - cell;
    vec4 ease = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
    float sum = 0.0;
    int corner = 0;
    do {
        ivec4 side = (ivec4(corner) >> ivec4(0, 1, 2, 3)) & 1;
        vec4 share = mix(1.0 - ease, ease, vec4(side));
        float there = along_gradient(uvec4(ivec4(cell) + side), within - vec4(side), dimensions);
        sum += share.x * share.y * share.z * share.w * there;
    } while (++corner < (1 << dimensions));
    return sum;
}

// In [-1, 1]. Coordinates beyond `dimensions` are 0. It repeats every 100000, as Cycles' does to stay exact.
float signed_noise(vec4 place, int dimensions) {
    vec4 beyond = 0.5 * vec4(greaterThanEqual(abs(place), vec4(1000000.0)));
    place = place - 100000.0 * trunc(place / 100000.0) + beyond;
    float scale = dimensions == 1 ? 0.25 : dimensions == 2 ? 0.6616 : dimensions == 3 ? 0.982 : 0.8344;
    return scale * perlin(place, dimensions);
}
