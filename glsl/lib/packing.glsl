// SPDX-License-Identifier: GPL-3.0-or-later
// A unit vector in one float: octahedral, 12 bits an axis, as an integer below 2^24 (exact).
// Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors".

float pack_direction(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 e = n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    vec2 q = floor((e * 0.5 + 0.5) * 4095.0 + 0.5);
    return q.x * 4096.0 + q.y;
}

// A vector along it, no shorter than 0.57.
vec3 unpack_along(float code) {
    float x = floor(code / 4096.0);
    vec2 e = vec2(x, code - x * 4096.0) / 4095.0 * 2.0 - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return n;
}

vec3 unpack_direction(float code) { return normalize(unpack_along(code)); }
