// SPDX-License-Identifier: GPL-3.0-or-later
// Of the ray that asks: whether it is the camera's (0), a shadow ray (1), diffuse (2), glossy (3); its length [m] (4),
// how many scattered before it (5). A photon counts as seen by a diffuse ray.
// Operands: [which].

vec4 run_light_path(vec4 which) {
    int wanted = int(which.x);
    if (wanted < 4) return vec4(vec3(asking[wanted]), 1.0);
    return vec4(vec3(wanted == 4 ? (come + shading_point.far) * world_space().x.x : scattered), 1.0);
}
