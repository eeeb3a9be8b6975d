// SPDX-License-Identifier: GPL-3.0-or-later
// Where eye rays go through a pixel. Each pixel has its own places: were they those of all, what passes see of an edge
// would be off all along it, which no denoiser could tell from an edge.
#include "lib/constants.glsl"
#include "lib/rng.glsl"

const uint FIRST_DIGITS = 0xf8000000u;  // of the first pass's place in a pixel that are the middle's

uvec4 owen_scrambled(uvec4 bits, uvec4 keys) {
    return uvec4(shuffled(bits.x, keys.x), shuffled(bits.y, keys.y), shuffled(bits.z, keys.z), shuffled(bits.w, keys.w));
}

// A pass's place in a pixel, and on a lens, in (0, 1)^4. Those of a half of the passes are Sobol's sequence, scrambled by
// Owen's way (Burley 2020): of each 2^k from a multiple on one is in each of 2^k equal parts of the pixel, however halving
// cuts these. The very first is about the middle, as in Cycles: depths are its, and edges are off by half as much there. Not
// in the middle: rays through edges of triangles meet either. So another pass of its half, by itself, may only be where that
// one leaves places free: of the first N the filter is off by less than one of them.
vec4 place_in_pixel(uint seed, uint pass_index, uint pixel) {
    PassOfHalf own = pass_of_half(pass_index);
    uvec4 keys = random_bits(seed, EVEN_TOGETHER + own.which, pixel, DIMENSION_PIXEL);
    // Of a key the lowest bit decides most, which pcg4d mixes least; the highest decides next to nothing.
    keys = uvec4(mix_bits(keys.x), mix_bits(keys.y), mix_bits(keys.z), mix_bits(keys.w));
    uvec4 bits = owen_scrambled(sobol4(own.number), keys);
    if (own.which == 0u) {
        // To move all by digits, and to turn them round, keeps them as even.
        bits.xy ^= (owen_scrambled(uvec4(0u), keys).xy ^ (1u << 31u)) & FIRST_DIGITS;
        bits.xy ^= (keys.xy >> 31u) * 0xffffffffu;
    }
    return (vec4(bits >> 9u) + 0.5) * (1.0 / 8388608.0);  // exact in float32, never 0 or 1
}

// How far from a pixel's middle, in the filter's widths: as often as it weighs that, so that all rays weigh the same.
#if defined(PIXEL_BOX)
float pixel_filter_offset(float drawn) { return drawn - 0.5; }
#elif defined(PIXEL_GAUSS)
// Blender's width is four standard deviations. Giles 2010, "Approximating the erfinv function", in single precision.
float pixel_filter_offset(float drawn) {
    float x = 2.0 * drawn - 1.0, w = max(0.0, -log((1.0 - x) * (1.0 + x))), p;
    if (w < 5.0) {
        w -= 2.5;
        p = 3.43273939e-07 + w * 2.81022636e-08;
        p = 0.00021858087 + w * (-4.39150654e-06 + w * (-3.5233877e-06 + w * p));
        p = 1.50140941 + w * (0.246640727 + w * (-0.00417768164 + w * (-0.00125372503 + w * p)));
    } else {
        w = sqrt(w) - 3.0;
        p = 0.000100950558 - w * 0.000200214257;
        p = 0.00573950773 + w * (-0.00367342844 + w * (0.00134934322 + w * p));
        p = 2.83297682 + w * (1.00167406 + w * (0.00943887047 + w * (-0.0076224613 + w * p)));
    }
    return 0.25 * 1.41421356 * x * p;
}
#elif defined(PIXEL_BLACKMAN_HARRIS)
// Harris 1978, the window of four terms, of which Blender's width is half: from its edge inwards, its middle at 1, how much
// of it lies below x, and its density there.
vec2 blackman_harris(float x) {
    float c = cos(PI * x), s = sin(PI * x), c2 = 2.0 * c * c - 1.0, c3 = c * (4.0 * c * c - 3.0);
    float below = 0.35875 * x - s * (0.48829 - 0.14128 * c + 0.01168 / 3.0 * (4.0 * c * c - 1.0)) / PI;
    float density = 0.35875 - 0.48829 * c + 0.14128 * c2 - 0.01168 * c3;
    return vec2(below, density) / (2.0 * 0.35875);
}

float pixel_filter_offset(float drawn) {
    float below = min(drawn, 1.0 - drawn), x = sqrt(sqrt(2.0 * below));
    // Newton's method on logarithms: the window goes by powers of x. Twice, to 2e-4 at worst, 6e-7 in the mean.
    for (int i = 0; i < 2; i++) {
        vec2 found = blackman_harris(x);
        x = min(1.0, x * pow(below / max(found.x, 1e-9), found.x / (x * found.y)));
    }
    return drawn < 0.5 ? x - 1.0 : 1.0 - x;
}
#endif
