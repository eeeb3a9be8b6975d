// SPDX-License-Identifier: GPL-3.0-or-later
// The means of what two filters make of both halves, and how much farther from the truth they are than what the first
// one does: each by the other half, whose noise it does not know. Light is in units of what is taken for dark, as in
// mixture_told.glsl.

void kernel() {
    float scale = 1.0 / floor_light;
    vec3 first = load_first().value.rgb * scale, other = load_other().value.rgb * scale;
    vec3 clean = load_clean().value.rgb, other_clean = load_other_clean().value.rgb;
    vec3 mean = (clean + load_second_clean().value.rgb) / 2.0, other_mean = (other_clean + load_second_other_clean().value.rgb) / 2.0;
    store_mean(Sum(vec4(mean, 0.0)));
    store_other_mean(Sum(vec4(other_mean, 0.0)));
    vec3 a = mean * scale, b = other_mean * scale, c = clean * scale, d = other_clean * scale;
    vec3 smoothed = (a + b + c + d) / 4.0, apart = (a - c) * (a + c - 2.0 * other) + (b - d) * (b + d - 2.0 * first);
    store_worse(Sum(vec4(dot(apart, 1.0 / (smoothed * smoothed + 1.0)), 0.0, 0.0, 0.0)));
}
