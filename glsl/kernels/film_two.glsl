// SPDX-License-Identifier: GPL-3.0-or-later
// Add passes to the sums of two images.
#include "lib/compensated_sum.glsl"
#include "lib/of_pass.glsl"

void kernel() {
    vec4 sum = load_sum().value, low = load_low().value;
    vec4 second_sum = load_second_sum().value, second_low = load_second_low().value;
    for (int i = 0; i < passes; i++) {
        if (counts(added, i)) add_to(sum, low, of_pass(image, i));
        if (counts(second_added, i)) add_to(second_sum, second_low, of_pass(second_image, i));
    }
    store_next_sum(Sum(sum));
    store_next_low(Sum(low));
    store_next_second_sum(Sum(second_sum));
    store_next_second_low(Sum(second_low));
}
