// SPDX-License-Identifier: GPL-3.0-or-later
// Both halves of a picture in units of a light, without what is below zero, and the features' means: as a denoiser is
// given them. Of one pass the halves are the same.

vec4 given(vec3 light) { return vec4(max(light, vec3(0.0)) / unit, 0.0); }

void kernel() {
    vec3 picture = load_picture().value.rgb, first = load_half().value.rgb;
    store_first(Sum(given(first)));
    store_other(Sum(given(share < 1.0 ? (picture - share * first) / (1.0 - share) : first)));
    store_albedo(Sum(load_albedo_sum().value / passes));
    store_normal(Sum(load_normal_sum().value / passes));
}
