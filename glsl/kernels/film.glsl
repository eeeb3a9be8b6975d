// SPDX-License-Identifier: GPL-3.0-or-later
// Add a pass to the sum of an image.
#include "lib/compensated_sum.glsl"

void kernel() {
    vec4 sum = load_sum().value, low = load_low().value;
    add_to(sum, low, load_value().texel);
    store_next_sum(Sum(sum));
    store_next_low(Sum(low));
}
