// SPDX-License-Identifier: GPL-3.0-or-later
// Add a pass to the sum of squared differences from the mean (Welford 1962): no cancellation.
void kernel() {
    Radiance value = load_value();
    vec4 squares = load_squares().value;
    if (passes_before > 0) {
        float n = float(passes_before);
        vec4 difference = vec4(value.radiance, value.alpha) - load_sum().value / n;
        squares += difference * difference * (n / (n + 1.0));
    }
    store_next_squares(Sum(squares));
}
