// SPDX-License-Identifier: GPL-3.0-or-later
// Random numbers of a pixel that are more even over passes than chance is.
#include "lib/constants.glsl"
#include "lib/rng.glsl"
#include "lib/pixel.glsl"

// Two numbers in [0, 1), evenly of each pass by itself. Those of two passes from an even one on are in both halves of
// each, and of four from a fourth on in all quarters: the first points of Sobol's sequence, shuffled by chance.
vec2 even_over_passes(uint dimension) {
    uint pixel = uint(pixel_number(load_pixel().at)), number = pass_index & 3u;
    uint across = (number >> 1u) | ((number & 1u) << 1u);
    uvec2 part = uvec2(across, across ^ (number & 2u));
    part ^= uvec2(4.0 * random4(seed, 0x40000000u + (pass_index >> 2u), pixel, dimension).zw);
    vec2 within = random4(seed, pass_index, pixel, dimension).xy;
    return min(0.25 * (vec2(part) + within), BELOW_ONE);
}
