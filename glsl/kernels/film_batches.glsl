// SPDX-License-Identifier: GPL-3.0-or-later
// Add passes to the sums of squared differences of batch means from their mean (Welford 1962): no
// cancellation. Passes share low-discrepancy sequences, so neighbouring ones err in opposite directions;
// the means of batches of 2 or 4 passes carry less of that error than single passes, as the whole does.
#include "lib/compensated_sum.glsl"
#include "lib/of_pass.glsl"

// The squares with the batch that ends with a pass, if one does.
vec4 with_batch(vec4 squares, vec4 batch, vec4 sum_before, int before, int length) {
    int batches = before / length;
    if ((before + 1) % length != 0 || batches == 0) return squares;
    float n = float(batches);
    vec4 difference = (batch - sum_before / n) / float(length);
    return squares + difference * difference * (n / (n + 1.0));
}

void kernel() {
    vec4 sum = load_sum().value, low = load_low().value, pair = load_pair().value, four = load_four().value;
    vec4 pair_squares = load_pair_squares().value, four_squares = load_four_squares().value;
    for (int i = 0; i < passes; i++) {
        int before = passes_before + i;
        if (before % 2 == 0) pair = vec4(0.0);
        if (before % 4 == 0) four = vec4(0.0);
        vec4 x = of_pass(image, i), sum_pair = sum - pair, sum_four = sum - four;
        pair += x;
        four += x;
        pair_squares = with_batch(pair_squares, pair, sum_pair, before, 2);
        four_squares = with_batch(four_squares, four, sum_four, before, 4);
        add_to(sum, low, x);
    }
    store_next_pair(Sum(pair));
    store_next_four(Sum(four));
    store_next_pair_squares(Sum(pair_squares));
    store_next_four_squares(Sum(four_squares));
}
