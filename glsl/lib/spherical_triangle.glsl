// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles as they are seen from the origin, by the unit directions to their corners.

// The solid angle [sr] (Van Oosterom & Strackee 1983).
float solid_angle(vec3 a, vec3 b, vec3 c) {
    return 2.0 * atan(abs(dot(a, cross(b, c))), 1.0 + dot(a, b) + dot(b, c) + dot(c, a));
}

// Whether a direction lies within.
bool is_within(vec3 a, vec3 b, vec3 c, vec3 direction) {
    float turn = dot(a, cross(b, c)) < 0.0 ? -1.0 : 1.0;
    vec3 sides = turn * vec3(
        dot(direction, cross(b, c)), dot(direction, cross(c, a)), dot(direction, cross(a, b)));
    return min(sides.x, min(sides.y, sides.z)) >= 0.0;
}

// A unit vector at a right angle to n, on the side of v.
vec3 aside(vec3 v, vec3 n) { return normalize(v - dot(v, n) * n); }

// A direction uniform in the solid angle (Arvo 1995, "Stratified Sampling of Spherical Triangles"). Needs one that
// float32 angles resolve.
vec3 sample_solid_angle(vec3 a, vec3 b, vec3 c, float angle, vec2 u) {
    vec3 to_b = aside(b, a), to_c = aside(c, a);
    float cos_a = dot(to_b, to_c), sin_a = abs(dot(a, cross(to_b, to_c))), turn = u.x * angle - atan(sin_a, cos_a);
    float s = sin(turn), t = cos(turn), p = t - cos_a, r = s + sin_a * dot(a, b);
    float below = (r * s + p * t) * sin_a;
    float q = abs(below) > 0.0 ? clamp(((r * t - p * s) * cos_a - r) / below, -1.0, 1.0) : 1.0;
    vec3 corner = q * a + sqrt(1.0 - q * q) * to_c;  // of the part of that share, on the side a to c
    vec3 off = corner - b;
    float versine = u.y * 0.5 * dot(off, off);
    return (1.0 - versine) * b + sqrt(max(0.0, versine * (2.0 - versine))) * aside(corner, b);
}
