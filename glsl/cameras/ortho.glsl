// SPDX-License-Identifier: GPL-3.0-or-later
// An orthographic camera. The window is as large as what it sees.
// Parameters: none.

EyeRay ray_ortho(vec2 at) {
    return EyeRay(vec3(at, 0.0), vec3(0.0, 0.0, -1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0));
}
