// SPDX-License-Identifier: GPL-3.0-or-later
// Running sums with Kahan's compensation (here Knuth's TwoSum), so that a million passes lose nothing.

// The rounding error of a + b. Knuth's TwoSum; `precise` keeps the compiler from cancelling it.
vec4 sum_error(vec4 a, vec4 b) {
    precise vec4 s = a + b;
    precise vec4 bb = s - a;
    precise vec4 aa = s - bb;
    precise vec4 db = b - bb;
    precise vec4 da = a - aa;
    return da + db;
}

// Add x to a sum and what it had no digits for.
void add_to(inout vec4 sum, inout vec4 low, vec4 x) {
    precise vec4 addend = x + low;
    precise vec4 total = sum + addend;
    low = sum_error(sum, addend);
    sum = total;
}
