// SPDX-License-Identifier: GPL-3.0-or-later
// Rays of the eye in the camera's own space: it looks along -Z, +Y is up.
#include "lib/constants.glsl"

// As a pinhole sends it. What is in focus lies at start + direction times the focus distance; clip distances
// are multiples of direction, too. A direction of zero: nothing is seen there.
struct EyeRay {
    vec3 start;
    vec3 direction;
    vec3 lens_x;  // unit, which way a point of the lens lies for this ray
    vec3 lens_y;
};

const EyeRay NO_EYE_RAY = EyeRay(vec3(0.0), vec3(0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0));

// Of a panorama: distances are along the ray, and the lens turns with it. `axis`: where lens_x points to.
EyeRay panoramic_ray(vec3 direction, vec3 axis, float handedness) {
    vec3 x = normalize(axis - dot(axis, direction) * direction);
    return EyeRay(vec3(0.0), direction, x, handedness * cross(direction, x));
}

// Of a panorama whose middle is where the camera looks: `sky` points there along +X, up along +Z.
EyeRay sky_ray(vec3 sky) {
    return panoramic_ray(vec3(-sky.y, sky.z, -sky.x), vec3(0.0, 0.0, -1.0), 1.0);
}

// `from_axis` [rad] from where the camera looks, towards `at` in the picture.
EyeRay fisheye_ray(vec2 at, float from_axis) {
    float far = length(at);
    vec2 side = far > 0.0 ? at / far : vec2(1.0, 0.0);
    float sine = sin(from_axis);
    return sky_ray(vec3(cos(from_axis), -side.x * sine, side.y * sine));
}
