// SPDX-License-Identifier: GPL-3.0-or-later
// How the Mix node gives a of b its hue (0), saturation (1), value (2), or hue and saturation (3), as Cycles 5.0 has
// it (kernel/svm/color_util.h).
// Operands: a, b, share, [blend].
#include "lib/hsv.glsl"

vec4 run_blend_hue(vec4 first, vec4 second, vec4 share, vec4 blend) {
    vec3 a = rgb_to_hsv(first.xyz), b = rgb_to_hsv(second.xyz), wanted = a;
    int which = int(blend.x);
    float t = share.x;
    if (which == 0 || which == 3) wanted.x = b.x;
    if (which == 3) wanted.y = b.y;
    if (which == 1) wanted.y = mix(a.y, b.y, t);
    if (which == 2) wanted.z = mix(a.z, b.z, t);
    vec3 result = hsv_to_rgb(wanted);
    if (which == 0 || which == 3) result = b.y == 0.0 ? first.xyz : mix(first.xyz, result, t);
    if (which == 1 && a.y == 0.0) result = first.xyz;
    return vec4(result, 1.0);
}
