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

uvec4 random_bits(uint seed, uint pass_index, uint element, uint dimension) {
    return pcg4d(uvec4(element, dimension, pass_index, mix_bits(seed)));
}

// Four independent uniform numbers in [0, 1).
vec4 random4(uint seed, uint pass_index, uint element, uint dimension) {
    uvec4 bits = random_bits(seed, pass_index, element, dimension);
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
vec2 second_sequence(vec2 start, uint n) {
    uvec2 step = uvec2(2726840505u, 1455715471u);  // 2^32 times 0.63489203, 0.33893517
    return fract(start + vec2((step * n) >> 8u) * (1.0 / 16777216.0));
}

// Numbers that no pass has stand for several rays of a pass from MOST_PASSES on (lib/even.glsl), for passes that are even
// together from 0x40000000 on, for pairs of them and for those that photons are aimed by from 0x80000000 on
// (lib/shadow_ray.glsl, aim.py); elements 0xfffffffd to 0xffffffff have a pass's own.
const uint ALL_PIXELS = 0xfffffffdu;
// Where each kernel's dimensions begin; a path's bounce or depth is added.
const uint DIMENSION_LIGHT = 0u;        // which light, and how a photon starts there
const uint DIMENSION_LIGHT_PORTAL = 2u; // through which face of a box
const uint DIMENSION_AIM = 0x10u;       // what aiming asks of the numbers beyond their digits
const uint DIMENSION_REFLECT = 0x100u;  // + bounce
const uint DIMENSION_SHADE_PHOTON = 0x800u;  // + bounce
const uint DIMENSION_SCATTER = 0x1000u;  // + depth
const uint DIMENSION_COVERAGE = 0x1800u;  // + depth
const uint DIMENSION_SHADE = 0x1c00u;  // + depth
const uint DIMENSION_EXPECTED = 0x1e00u;  // + depth
const uint DIMENSION_DIRECT = 0x2000u;  // + shadow ray + 0x8000 for those by lobes + 0x10000 * depth
const uint DIMENSION_CHOICE = 0xf000u;  // + 0x10000 * depth: of lights
const uint DIMENSION_PIXEL = 0xf100u;  // and the lens
const uint DIMENSION_WAVELENGTH = 0xf200u;
const uint DIMENSION_FLIGHT = 0xf300u;  // + 2 * depth, and the next one
const uint DIMENSION_PHOTON_FLIGHT = 0xf800u;  // + bounce
const uint DIMENSION_WALK = 0x80000000u;  // + those of lib/random_walk.glsl

// In which half of all passes one is, 0 or 1 (in_first_half of film/film.py), and its number there. The halves' random
// numbers know nothing of each other, for they are to tell their noise.
struct PassOfHalf { uint which; uint number; };

PassOfHalf pass_of_half(uint pass_index) {
    bool is_early = pass_index < 4u;
    uint pair = is_early ? pass_index : pass_index >> 1u, parity = pair;
    for (uint bits = 16u; bits > 0u; bits >>= 1u) parity ^= parity >> bits;
    uint number = is_early ? pass_index >> 1u : 2u * (pass_index >> 2u) + (pass_index & 1u);
    return PassOfHalf(parity & 1u, number);
}

// Passes whose numbers are even together: sixteen of a half. `group` stands for them where random4 takes a pass; `number`,
// 0 to 15: a pass's among them.
const uint EVEN_TOGETHER = 0x40000000u;
struct EvenPasses { uint group; uint number; };

EvenPasses even_passes(uint pass_index) {
    PassOfHalf own = pass_of_half(pass_index);
    return EvenPasses(EVEN_TOGETHER + 2u * (own.number >> 4u) + own.which, own.number & 15u);
}

uint reversed_bits(uint x) {
    x = ((x >> 1u) & 0x55555555u) | ((x & 0x55555555u) << 1u);
    x = ((x >> 2u) & 0x33333333u) | ((x & 0x33333333u) << 2u);
    x = ((x >> 4u) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4u);
    x = ((x >> 8u) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8u);
    return (x >> 16u) | (x << 16u);
}

// Permutes numbers so that each aligned block of 2^k of them maps to an aligned block, for every k (Owen's scrambling;
// Laine & Karras 2011): every other number, say, is then no longer all on one side.
uint shuffled(uint x, uint key) {
    x = reversed_bits(x) + key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reversed_bits(x);
}

// Point n of Sobol's sequence in four dimensions, of 32 binary digits (Joe & Kuo 2008).
uvec4 sobol4(uint n) {
    // What the next digit of n adds; of the third and fourth dimension also what the one or two after it do.
    uint first = 1u << 31u, second = first;
    uvec2 third = uvec2(1u << 31u, 3u << 30u);
    uvec3 fourth = uvec3(1u << 31u, 3u << 30u, 1u << 29u);
    uvec4 point = uvec4(0u);
    for (; n > 0u; n >>= 1u) {
        if ((n & 1u) != 0u) point ^= uvec4(first, second, third.x, fourth.x);
        first >>= 1u;
        second ^= second >> 1u;
        third = uvec2(third.y, third.y ^ third.x ^ (third.x >> 2u));
        fourth = uvec3(fourth.yz, fourth.y ^ fourth.x ^ (fourth.x >> 3u));
    }
    return point;
}

// The four numbers that a photon, of so many a pass, starts by: Sobol's sequence, shuffled by chance, goes on from pass
// to pass. Boxes that halving leaves of all numbers (lib/aim.glsl) have their share of its points. Those that others
// are aimed by start by chance: they are to tell what that does.
vec4 photon_sequence(uint seed, uint pass_index, uint photon, uint photons) {
    if (pass_index >= 0x80000000u) return random4(seed, pass_index, photon, DIMENSION_LIGHT);
    EvenPasses passes = even_passes(pass_index);
    uvec4 shuffle = random_bits(seed, passes.group, 0xffffffffu, DIMENSION_LIGHT);
    uint key = random_bits(seed, passes.group, 0xfffffffeu, DIMENSION_LIGHT).x;
    uvec4 bits = sobol4(shuffled(passes.number * photons + photon, key)) ^ shuffle;
    return vec4(bits >> 8u) * (1.0 / 16777216.0);
}
