// SPDX-License-Identifier: GPL-3.0-or-later
// Wave Texture, as Cycles 5.0 has it (intern/cycles/kernel/svm/wave.h), in xyz and w, in [0, 1]. `rings`: else bands.
// `direction`: 0, 1, 2 an axis, 3 diagonal or spherical. `profile`: 0 sine, 1 saw, 2 triangle.
// Long to compile.
// Operands: vector, scale distortion detail detail_scale, detail_roughness phase, [rings] [direction] [profile].
#include "lib/constants.glsl"
#include "lib/fractal.glsl"

vec4 run_wave(vec4 vector, vec4 shape, vec4 more, vec4 options) {
    // As Cycles does, so that whole numbers fall on one side.
    vec3 at = (vector.xyz * shape.x + 0.000001) * 0.999999;
    int direction = int(options.y), profile = int(options.z);
    vec3 along = direction == 3 ? vec3(1.0) : vec3(equal(ivec3(direction), ivec3(0, 1, 2)));
    float phase;
    if (options.x > 0.5) phase = 20.0 * length(direction == 3 ? at : at * (1.0 - along));
    else phase = dot(at, along) * (direction == 3 ? 10.0 : 20.0);
    phase += more.y;
    if (shape.y != 0.0) {
        Fractal fractal = Fractal(FRACTAL_FBM, true, clamp(shape.z, 0.0, 15.0), more.x, 2.0, 0.0, 0.0);
        phase += shape.y * (2.0 * fractal_noise(vec4(at * shape.w, 0.0), fractal, 3) - 1.0);
    }
    float turns = phase / (2.0 * PI), height = fract(turns);
    if (profile == 0) height = 0.5 - 0.5 * cos(2.0 * PI * fract(turns));
    else if (profile == 2) height = 2.0 * abs(turns - floor(turns + 0.5));
    return vec4(height);
}
