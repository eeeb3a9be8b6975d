// SPDX-License-Identifier: GPL-3.0-or-later
// Add a pass to the sums of two images.
#include "lib/compensated_sum.glsl"

void kernel() {
    vec4 sum = load_sum().value, low = load_low().value;
    add_to(sum, low, load_value().texel);
    store_next_sum(Sum(sum));
    store_next_low(Sum(low));
    sum = load_second_sum().value;
    low = load_second_low().value;
    add_to(sum, low, load_second_value().texel);
    store_next_second_sum(Sum(sum));
    store_next_second_low(Sum(low));
}
