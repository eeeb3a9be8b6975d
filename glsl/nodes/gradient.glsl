// SPDX-License-Identifier: GPL-3.0-or-later
// Gradient Texture, as Cycles 5.0 has it (intern/cycles/kernel/svm/gradient.h), in xyz and w, in [0, 1]. `kind`:
// 0 linear, 1 quadratic, 2 easing, 3 diagonal, 4 radial, 5 quadratic sphere, 6 spherical.
// Operands: vector, [kind].
#include "lib/constants.glsl"

vec4 run_gradient(vec4 vector, vec4 options) {
    int kind = int(options.x);
    vec2 at = vector.xy;
    float first = clamp(at.x, 0.0, 1.0), height = at.x;
    // Less than 1 by Cycles' margin, so that what lies on the unit sphere is 0.
    float inside = max(0.999999 - length(vector.xyz), 0.0);
    if (kind == 1) height = first * first;
    else if (kind == 2) height = first * first * (3.0 - 2.0 * first);
    else if (kind == 3) height = 0.5 * (at.x + at.y);
    else if (kind == 4) height = (at == vec2(0.0) ? 0.0 : atan(at.y, at.x)) / (2.0 * PI) + 0.5;
    else if (kind == 5) height = inside * inside;
    else if (kind == 6) height = inside;
    return vec4(clamp(height, 0.0, 1.0));
}
