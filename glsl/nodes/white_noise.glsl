// SPDX-License-Identifier: GPL-3.0-or-later
// White Noise Texture of one to four dimensions, as Cycles 5.0 has it: xyz the colour, x also the value, each in
// [0, 1]. It hashes the bits of coordinates: where they round otherwise, it is another one.
// Operands: vector, w, [dimensions].
#include "lib/jenkins.glsl"

vec4 run_white_noise(vec4 vector, vec4 w, vec4 options) {
    int dimensions = int(options.x);
    vec3 at = vector.xyz;
    float t = w.x, value = hashed_3(at);
    vec2 more = vec2(hashed_4(vec4(at, 1.0)), hashed_4(vec4(at, 2.0)));
    if (dimensions == 1) {
        value = hashed_1(t);
        more = vec2(hashed_2(vec2(t, 1.0)), hashed_2(vec2(t, 2.0)));
    } else if (dimensions == 2) {
        value = hashed_2(at.xy);
        more = vec2(hashed_3(vec3(at.xy, 1.0)), hashed_3(vec3(at.xy, 2.0)));
    } else if (dimensions == 4) {
        value = hashed_4(vec4(at, t));
        more = vec2(hashed_4(vec4(at.z, at.x, t, at.y)), hashed_4(vec4(t, at.zyx)));
    }
    return vec4(value, more, value);
}
