// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/sampling.glsl"

// Uniform in the polygon of so many corners on the unit circle, with an edge that +X crosses squarely if it is
// not turned [rad]; on the disc, if they are fewer than three.
vec2 sample_aperture(vec2 u, int blades, float rotation) {
    if (blades < 3) return sample_disc(u);
    float sectors = u.x * float(blades), sector = min(floor(sectors), float(blades - 1));
    float half_angle = PI / float(blades), along = sqrt(sectors - sector);  // in a sector's triangle
    float turn = rotation + 2.0 * half_angle * sector;
    vec2 p = along * vec2(cos(half_angle), (2.0 * u.y - 1.0) * sin(half_angle));
    return mat2(cos(turn), sin(turn), -sin(turn), cos(turn)) * p;
}
