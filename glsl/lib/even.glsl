// SPDX-License-Identifier: GPL-3.0-or-later
// Random numbers of a pixel that are more even over passes than chance is.
#include "lib/constants.glsl"
#include "lib/rng.glsl"
#include "lib/pixel.glsl"

const uint MOST_PASSES = 0x04000000u;  // numbers from there on are of no pass

// Another number for each below 16, so that halves, quarters and eighths of them stay together (Owen's scrambling): of
// 15 random bits one turns the first half round, two the quarters in their halves, and so on.
uint scrambled(uint number, uint random) {
    uint other = 0u;
    for (int level = 0; level < 4; level++) {
        uint before = number >> (4 - level), bit = number >> (3 - level) & 1u;
        other = other << 1u | (bit ^ (random >> ((1u << level) - 1u + before) & 1u));
    }
    return other;
}

// Two numbers in [0, 1), evenly of each pass by itself. Those of passes that are even together are the first sixteen
// points of Sobol's sequence, in an order and moved by chance: so are each two, four and eight of them from a multiple on.
// Each dimension has an order of its own, for two would else go together: all rays of one lobe, say, to one side.
// Where a pass draws several, `which` of so `many`, its own are even together, too.
vec2 even_over_passes(uint element, uint dimension, uint which, uint many) {
    EvenPasses passes = even_passes(pass_index);
    uint number = passes.number * many + which;
    uvec4 random = random_bits(seed, passes.group + (number >> 4u) * MOST_PASSES, element, dimension);
    uvec2 part = (sobol4(scrambled(number & 15u, random.x)).xy ^ random.zw) >> 28u;
    vec2 within = random4(seed, pass_index + which * MOST_PASSES, element, dimension).xy;
    return min(0.0625 * (vec2(part) + within), BELOW_ONE);
}

vec2 even_over_passes(uint element, uint dimension) { return even_over_passes(element, dimension, 0u, 1u); }

// A pixel's own.
vec2 even_over_passes(uint dimension, uint which, uint many) {
    return even_over_passes(uint(pixel_number(load_pixel().at)), dimension, which, many);
}

vec2 even_over_passes(uint dimension) { return even_over_passes(dimension, 0u, 1u); }
