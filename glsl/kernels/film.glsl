// SPDX-License-Identifier: GPL-3.0-or-later
// Add passes to the sum of an image.
#include "lib/compensated_sum.glsl"
#include "lib/of_pass.glsl"

void kernel() {
    vec4 sum = load_sum().value, low = load_low().value;
    for (int i = 0; i < passes; i++) {
        if (counts(added, i)) add_to(sum, low, of_pass(image, i));
    }
    store_next_sum(Sum(sum));
    store_next_low(Sum(low));
}
