// SPDX-License-Identifier: GPL-3.0-or-later
// Hue, saturation and value or lightness, and back, as Cycles 5.0 calculates them (util/color.h), out of their ranges
// too: a hue that is not in [0, 1] is the last of the six.
#include "lib/colour.glsl"

float smallest(vec3 c) { return min(min(c.x, c.y), c.z); }

// 1 as a sixth of the circle: of a colour whose largest channel is v, by how much each is less, over the range.
float hue_of(vec3 rgb, float v, vec3 c) {
    float h = rgb.x == v ? c.z - c.y : rgb.y == v ? 2.0 + c.x - c.z : 4.0 + c.y - c.x;
    return (h < 0.0 ? h + 6.0 : h) / 6.0;
}

vec3 rgb_to_hsv(vec3 rgb) {
    float v = largest(rgb), range = v - smallest(rgb);
    if (range == 0.0 || v == 0.0) return vec3(0.0, 0.0, v);
    return vec3(hue_of(rgb, v, (v - rgb) / range), range / v, v);
}

vec3 hsv_to_rgb(vec3 hsv) {
    float s = hsv.y, v = hsv.z, h = hsv.x == 1.0 ? 0.0 : hsv.x * 6.0, i = floor(h), f = h - i;
    float p = v * (1.0 - s), q = v * (1.0 - s * f), t = v * (1.0 - s * (1.0 - f));
    vec3 first = i == 0.0 ? vec3(v, t, p) : i == 1.0 ? vec3(q, v, p) : vec3(p, v, t);
    vec3 last = i == 3.0 ? vec3(p, q, v) : i == 4.0 ? vec3(t, p, v) : vec3(v, p, q);
    return i >= 0.0 && i <= 2.0 ? first : last;
}

vec3 rgb_to_hsl(vec3 rgb) {
    float v = largest(rgb), low = smallest(rgb), range = v - low, l = min(1.0, 0.5 * (v + low));
    if (range == 0.0) return vec3(0.0, 0.0, l);
    return vec3(hue_of(rgb, v, (v - rgb) / range), range / (l > 0.5 ? 2.0 - v - low : v + low), l);
}

vec3 hsl_to_rgb(vec3 hsl) {
    vec3 around = abs(hsl.x * 6.0 - vec3(3.0, 2.0, 4.0));
    vec3 n = clamp(vec3(around.x - 1.0, 2.0 - around.yz), 0.0, 1.0);
    return (n - 0.5) * (1.0 - abs(2.0 * hsl.z - 1.0)) * hsl.y + hsl.z;
}
