// SPDX-License-Identifier: GPL-3.0-or-later
// What a mirror ball shows to an orthographic view along -Z. The window [0, 1]^2 encloses it.
// Parameters: none.

EyeRay ray_mirrorball(vec2 at) {
    vec2 p = 2.0 * at - 1.0;
    float depth2 = 1.0 - dot(p, p);
    if (depth2 < 0.0) return NO_EYE_RAY;
    vec3 normal = vec3(p, -sqrt(depth2));
    return panoramic_ray(-2.0 * normal.z * normal - vec3(0.0, 0.0, -1.0), vec3(1.0, 0.0, 0.0), -1.0);
}
