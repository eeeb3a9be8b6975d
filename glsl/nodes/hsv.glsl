// SPDX-License-Identifier: GPL-3.0-or-later
// A colour as hue, saturation and value (0) or lightness (2), or such a colour as red, green and blue (1, 3).
// Operands: colour, [conversion].
#include "lib/hsv.glsl"

vec4 run_hsv(vec4 colour, vec4 conversion) {
    vec3 c = colour.xyz, result = c;
    switch (int(conversion.x)) {
    case 0: result = rgb_to_hsv(c); break;
    case 1: result = hsv_to_rgb(c); break;
    case 2: result = rgb_to_hsl(c); break;
    case 3: result = hsl_to_rgb(c); break;
    }
    return vec4(result, 1.0);
}
