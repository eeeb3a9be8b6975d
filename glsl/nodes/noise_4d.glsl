// SPDX-License-Identifier: GPL-3.0-or-later
// Noise Texture of four dimensions, as Cycles 5.0 has it: xyz the colour, w the factor; unless `coloured`, both
// the factor. `kind` counts as lib/fractal.glsl does.
// Operands: vector, w, scale detail roughness lacunarity, offset gain distortion [kind], [normalized] [coloured].
#include "lib/noise.glsl"

vec4 run_noise_4d(vec4 vector, vec4 w, vec4 octaves, vec4 shape, vec4 options) {
    Fractal fractal = fractal_of(octaves, shape, options);
    return noise_texture(vec4(vector.xyz, w.x) * octaves.x, fractal, shape.z, options.y > 0.5, 4);
}
