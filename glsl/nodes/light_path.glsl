// SPDX-License-Identifier: GPL-3.0-or-later
// Of the ray that ends here: whether it is the camera's (0), diffuse (1), glossy (2); its length [m] (3), how many
// rays were before it (4). A photon's place is seen by a diffuse ray from where it goes next.
// Operands: [which].

vec4 run_light_path(vec4 which) {
#if defined(PHOTONS)
    vec3 seen_by = vec3(0.0, 1.0, 0.0);
    float before = 1.0;
#elif defined(EYE)
    vec3 seen_by = depth == 0 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 0.0, 1.0);
    float before = float(depth);
#else
    vec3 seen_by = vec3(1.0, 0.0, 0.0);
    float before = 0.0;
#endif
    int wanted = int(which.x);
    if (wanted < 3) return vec4(vec3(seen_by[wanted]), 1.0);
    return vec4(vec3(wanted == 3 ? here.far * world_space().x.x : before), 1.0);
}
