// SPDX-License-Identifier: GPL-3.0-or-later
// Rectangles, of corners `low` and `high` in the plane z = 0, as they are seen from a place above it.
#include "lib/sampling.glsl"

float solid_angle_to(vec2 corner, float height) {
    return atan(corner.x * corner.y, height * sqrt(dot(corner, corner) + height * height));
}

// By the four quadrants below the place.
float rectangle_solid_angle(vec3 place, vec2 low, vec2 high) {
    vec2 a = low - place.xy, b = high - place.xy;
    float h = max(place.z, 1.0e-20);  // atan(0, 0) is undefined
    return solid_angle_to(b, h) - solid_angle_to(vec2(a.x, b.y), h)
        - solid_angle_to(vec2(b.x, a.y), h) + solid_angle_to(a, h);
}

// A point of the rectangle, in directions uniform over its solid angle. Urena, Fajardo & King 2013, "An
// Area-Preserving Parametrization for Spherical Rectangles".
vec2 sample_spherical_rectangle(vec3 place, vec2 low, vec2 high, vec2 u) {
    vec2 a = low - place.xy, b = high - place.xy, size = high - low;
    float z = -place.z;
    // Normals of the planes through the place and the sides at y = a.y, x = b.x, y = b.y, x = a.x.
    vec4 side = vec4(a.y, b.x, b.y, a.x) * vec4(-size.x, size.y, size.x, -size.y);
    vec4 n = side / sqrt(z * z * vec4(size.x, size.y, size.x, size.y) * vec4(size.x, size.y, size.x, size.y)
        + side * side);
    vec4 angles = acos(clamp(-n * n.yzwx, -1.0, 1.0));
    float rest = 2.0 * PI - angles.z - angles.w;
    float angle = angles.x + angles.y - rest;
    float phi = u.x * angle + rest;
    float f = (cos(phi) * n.x - n.z) / sin(phi);
    float c = clamp((f > 0.0 ? 1.0 : -1.0) * inversesqrt(f * f + n.x * n.x), -1.0, 1.0);
    float x = clamp(-c * z * inversesqrt(max(1.0 - c * c, 1.0e-12)), a.x, b.x);
    float distance2 = x * x + z * z;
    float h0 = a.y * inversesqrt(distance2 + a.y * a.y), h1 = b.y * inversesqrt(distance2 + b.y * b.y);
    float h = mix(h0, h1, u.y);
    float y = h * h < 1.0 - 1.0e-6 ? h * sqrt(distance2) * inversesqrt(1.0 - h * h) : b.y;
    return place.xy + vec2(x, clamp(y, a.y, b.y));
}
