// SPDX-License-Identifier: GPL-3.0-or-later
// What is known of the object: its place in world space [m] (0), its colour, with alpha in w (1), its index (2), a
// random number (3).
// Operands: [which].

vec4 run_object(vec4 which) {
    Space own = object_space();
    int wanted = int(which.x);
    if (wanted == 0) return vec4(own.location, 1.0);
    if (wanted == 1) return own.colour;
    return vec4(vec3(wanted == 2 ? own.index : own.random), 1.0);
}
