// SPDX-License-Identifier: GPL-3.0-or-later
// Add a pass to the sums of squared differences of batch means from their mean (Welford 1962): no
// cancellation. Passes share low-discrepancy sequences, so neighbouring ones err in opposite directions;
// the means of batches of 2 or 4 passes carry less of that error than single passes, as the whole does.

// The squares with the batch that ends with this pass, if one does.
vec4 with_batch(vec4 squares, vec4 batch, vec4 sum_before, int length) {
    int batches = passes_before / length;
    if ((passes_before + 1) % length != 0 || batches == 0) return squares;
    float n = float(batches);
    vec4 difference = (batch - sum_before / n) / float(length);
    return squares + difference * difference * (n / (n + 1.0));
}

void kernel() {
    Radiance value = load_value();
    vec4 x = vec4(value.radiance, value.alpha), sum = load_sum().value;
    vec4 pair = passes_before % 2 == 0 ? vec4(0.0) : load_pair().value;
    vec4 four = passes_before % 4 == 0 ? vec4(0.0) : load_four().value;
    store_next_pair(Sum(pair + x));
    store_next_four(Sum(four + x));
    store_next_pair_squares(Sum(with_batch(load_pair_squares().value, pair + x, sum - pair, 2)));
    store_next_four_squares(Sum(with_batch(load_four_squares().value, four + x, sum - four, 4)));
}
