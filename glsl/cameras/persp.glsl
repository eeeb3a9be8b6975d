// SPDX-License-Identifier: GPL-3.0-or-later
// A perspective camera. The window is on the plane at unit distance.
// Parameters: none.

EyeRay ray_persp(vec2 at) {
    return EyeRay(vec3(0.0), vec3(at, -1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0));
}
