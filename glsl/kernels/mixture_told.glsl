// SPDX-License-Identifier: GPL-3.0-or-later
// Of each pixel, relative to the denoised picture: by its own value a bright speck would count for little. The variance
// of the plain mean; that, less its covariance with the denoised one's error; the squared distance of both; and the
// square of what of that speaks for the plain one. All light is in units of what is taken for dark, so that no square
// leaves float32.
#include "lib/mixture.glsl"

const float MOST = 3.4e38;

void kernel() {
    float scale = 1.0 / floor_light;
    vec3 clean = load_clean().value.rgb, other_clean = load_other_clean().value.rgb;
    vec3 plain = load_picture().value.rgb * scale, first = load_half().value.rgb * scale;
    vec3 smoothed = smooth_picture(clean, other_clean) * scale, weight = 1.0 / (smoothed * smoothed + 1.0);
    vec3 between = (first - plain) / (1.0 - share), clean_between = (clean - other_clean) * (unit * scale);
    vec3 away = smoothed - plain;
    float rest = share * (1.0 - share) / 3.0;
    float noise = rest * dot(between * between, weight), gained = rest * dot(between * (between - clean_between), weight);
    float apart = dot(away * away, weight) / 3.0, of_plain = apart - gained;
    store_told(Sum(vec4(noise, gained, apart, min(of_plain * of_plain, MOST))));
}
