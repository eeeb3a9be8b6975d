// SPDX-License-Identifier: GPL-3.0-or-later
// Magic Texture's colour, as Cycles 5.0 has it (intern/cycles/kernel/svm/magic.h), in xyz, and its mean in w.
// Operands: vector, scale distortion [depth].
#include "lib/constants.glsl"

vec4 run_magic(vec4 vector, vec4 options) {
    vec3 at = vector.xyz - 2.0 * PI * trunc(vector.xyz / (2.0 * PI));
    float k = options.y;
    int depth = int(options.z);
    at *= 5.0 * options.x;
    float x = sin(at.x + at.y + at.z), y = cos(-at.x + at.y - at.z), z = -cos(-at.x - at.y + at.z);
    if (depth > 0) {
        x *= k;
        z *= k;
        y = -cos(x - y * k + z) * k;
    }
    if (depth > 1) x = cos(x - y - z) * k;
    if (depth > 2) z = sin(-x - y - z) * k;
    if (depth > 3) x = -cos(-x + y - z) * k;
    if (depth > 4) y = -sin(-x + y + z) * k;
    if (depth > 5) y = -cos(-x + y + z) * k;
    if (depth > 6) x = cos(x + y + z) * k;
    if (depth > 7) z = sin(x + y - z) * k;
    if (depth > 8) x = -cos(-x - y + z) * k;
    if (depth > 9) y = -sin(x - y + z) * k;
    vec3 colour = vec3(x, y, z);
    if (k != 0.0) colour /= 2.0 * k;
    colour = 0.5 - colour;
    return vec4(colour, (colour.x + colour.y + colour.z) / 3.0);
}
