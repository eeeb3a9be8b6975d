// SPDX-License-Identifier: GPL-3.0-or-later
// A fisheye whose angles go with the distance from the middle, half of fisheye_fov [rad] at the edge of a circle that
// the window [0, 1]^2 encloses.
// Parameters: fisheye_fov.

EyeRay ray_fisheye_equidistant(vec2 at) {
    vec2 p = 2.0 * at - 1.0;
    float far = length(p);
    if (far > 1.0) return NO_EYE_RAY;
    return fisheye_ray(p, 0.5 * camera_parameters.x * far);
}
