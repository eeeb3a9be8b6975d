// SPDX-License-Identifier: GPL-3.0-or-later
// A colour of another hue, saturation and value, as Cycles 5.0 has it (kernel/svm/hsv.h).
// Operands: hue saturation value factor, colour.
#include "lib/hsv.glsl"

vec4 run_hue_saturation(vec4 change, vec4 colour) {
    vec3 hsv = rgb_to_hsv(colour.xyz);
    hsv = vec3(fract(hsv.x + change.x + 0.5), clamp(hsv.y * change.y, 0.0, 1.0), hsv.z * change.z);
    return vec4(max(mix(colour.xyz, hsv_to_rgb(hsv), change.w), vec3(0.0)), 1.0);
}
