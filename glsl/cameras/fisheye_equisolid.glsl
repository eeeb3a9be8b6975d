// SPDX-License-Identifier: GPL-3.0-or-later
// A fisheye that shows equal solid angles equally large: 2 fisheye_lens sin(angle / 2) from the sensor's middle,
// all in one unit, up to half of fisheye_fov [rad]. The window [0, 1]^2 is the sensor.
// Parameters: fisheye_lens, fisheye_fov, sensor_width, sensor_height.

EyeRay ray_fisheye_equisolid(vec2 at) {
    float lens = camera_parameters.x;
    vec2 p = (at - 0.5) * camera_parameters.zw;
    float far = length(p);
    if (far > 2.0 * lens * sin(0.25 * camera_parameters.y)) return NO_EYE_RAY;
    return fisheye_ray(p, 2.0 * asin(far / (2.0 * lens)));
}
