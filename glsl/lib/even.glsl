// SPDX-License-Identifier: GPL-3.0-or-later
// Random numbers of a pixel that are more even over passes than chance is.
#include "lib/constants.glsl"
#include "lib/rng.glsl"
#include "lib/pixel.glsl"

// Sobol's second sequence: what each bit of a point's number adds. The first one is the number's bits turned round.
const uint SOBOL_COLUMNS[4] = uint[4](8u, 12u, 10u, 15u);

// Two numbers in [0, 1), evenly of each pass by itself. Those of passes that are even together are the first sixteen
// points of Sobol's sequence, shuffled by chance: so are each two, four and eight of them from a multiple on.
vec2 even_over_passes(uint dimension) {
    uint pixel = uint(pixel_number(load_pixel().at));
    EvenPasses passes = even_passes(pass_index);
    uvec2 part = uvec2(16.0 * random4(seed, passes.group, pixel, dimension).zw);
    for (int bit = 0; bit < 4; bit++) {
        if ((passes.place >> bit & 1u) != 0u) part ^= uvec2(8u >> bit, SOBOL_COLUMNS[bit]);
    }
    vec2 within = random4(seed, pass_index, pixel, dimension).xy;
    return min(0.0625 * (vec2(part) + within), BELOW_ONE);
}
