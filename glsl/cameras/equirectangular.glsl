// SPDX-License-Identifier: GPL-3.0-or-later
// A panorama of longitudes and latitudes [rad]; both 0 is where the camera looks. The window is [0, 1]^2.
// Parameters: longitude_min, longitude_max, latitude_min, latitude_max.

EyeRay ray_equirectangular(vec2 at) {
    float longitude = mix(camera_parameters.x, camera_parameters.y, at.x);
    float latitude = mix(camera_parameters.z, camera_parameters.w, at.y);
    float level = cos(latitude);
    return sky_ray(vec3(level * cos(longitude), -level * sin(longitude), sin(latitude)));
}
