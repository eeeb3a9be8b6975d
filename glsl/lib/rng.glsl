// SPDX-License-Identifier: GPL-3.0-or-later
// Counter-based random numbers: a pure function of (seed, pass, element, dimension), so every
// layer and every order of execution draws the same ones.

// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering", pcg4d.
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Ettinger 2019's "lowbias32": every bit of the result depends on every bit of x. pcg4d alone spreads
// a top bit too little, and users' seeds may differ in any.
uint mix_bits(uint x) {
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

// Four independent uniform numbers in [0, 1).
vec4 random4(uint seed, uint pass_index, uint element, uint dimension) {
    uvec4 bits = pcg4d(uvec4(element, dimension, pass_index, mix_bits(seed)));
    return vec4(bits >> 8u) * (1.0 / 16777216.0);  // 24 bits: exact in float32, never 1
}

// Point n of the R2 sequence (Roberts 2018) shifted by start, modulo 1: its first N points cover the
// square with discrepancy O(1 / N) whatever the shift.
vec2 r2_sequence(vec2 start, uint n) {
    uvec2 step = uvec2(3242174889u, 2447445414u);  // 2^32 / 1.3247..., 2^32 / 1.3247...^2
    return fract(start + vec2((step * n) >> 8u) * (1.0 / 16777216.0));
}

// The same for two dimensions more: of 1500 pairs of steps by chance, the one whose combinations with R2's, by whole
// numbers up to 20, stay farthest from whole numbers. So points of both sequences fill all four dimensions evenly.
vec2 lens_sequence(vec2 start, uint n) {
    uvec2 step = uvec2(2726840505u, 1455715471u);  // 2^32 times 0.63489203, 0.33893517
    return fract(start + vec2((step * n) >> 8u) * (1.0 / 16777216.0));
}

// Numbers that no pass has stand for fours of passes from 0x40000000 on (lib/even.glsl), for pairs of them and for those
// that photons are aimed by from 0x80000000 on (lib/shadow_ray.glsl, aim.py); element 0xffffffff has a pass's own numbers.
// Where each kernel's dimensions begin; a path's bounce or depth is added.
const uint DIMENSION_LIGHT = 0u;        // which light, and its direction
const uint DIMENSION_LIGHT_POINT = 1u;  // where on the light
const uint DIMENSION_LIGHT_PORTAL = 2u; // through which face of a box
const uint DIMENSION_AIM = 0x10u;       // + a fourth of the halvings
const uint DIMENSION_REFLECT = 0x100u;  // + bounce
const uint DIMENSION_SHADE_PHOTON = 0x800u;  // + bounce
const uint DIMENSION_SCATTER = 0x1000u;  // + depth
const uint DIMENSION_COVERAGE = 0x1800u;  // + depth
const uint DIMENSION_SHADE = 0x1c00u;  // + depth
const uint DIMENSION_DIRECT = 0x2000u;  // + shadow ray + 0x8000 for those by lobes + 0x10000 * depth
const uint DIMENSION_CHOICE = 0xf000u;  // + 0x10000 * depth: of lights
const uint DIMENSION_LENS = 0xf100u;
const uint DIMENSION_WAVELENGTH = 0xf200u;
