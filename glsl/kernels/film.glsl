// SPDX-License-Identifier: GPL-3.0-or-later
// Add a pass to a running sum, compensated so that a million passes lose nothing.

// The rounding error of a + b. Knuth's TwoSum; `precise` keeps the compiler from cancelling it.
vec4 sum_error(vec4 a, vec4 b) {
    precise vec4 s = a + b;
    precise vec4 bb = s - a;
    precise vec4 aa = s - bb;
    precise vec4 db = b - bb;
    precise vec4 da = a - aa;
    return da + db;
}

void kernel() {
    Sum sum = load_sum();
    Sum low = load_low();
    precise vec4 x = load_value().texel;
    precise vec4 addend = x + low.value;
    precise vec4 total = sum.value + addend;
    store_next_sum(Sum(total));
    store_next_low(Sum(sum_error(sum.value, addend)));
}
