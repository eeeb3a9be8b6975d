// SPDX-License-Identifier: GPL-3.0-or-later
// Gabor Texture of two dimensions, as Cycles 5.0 has it: x (and w) the value, y the phase, z the intensity.
// `orientation`: of the waves [rad].
// Long to compile.
// Operands: vector, scale frequency anisotropy orientation.
#include "lib/gabor.glsl"

vec4 run_gabor_2d(vec4 vector, vec4 options) {
    vec2 place = vector.xy * options.x, corner = floor(place), phasor = vec2(0.0);
    float frequency = max(0.001, options.y), spread = 1.0 - clamp(options.z, 0.0, 1.0);
    for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x)
    for (int i = 0; i < IMPULSES; ++i) {
        vec2 offset = vec2(float(x), float(y)), cell = corner + offset;
        float first = float(3 * i);
        float direction = options.w + (hashed_3(vec3(cell, first)) - 0.5) * PI * spread;
        vec3 seed = vec3(cell, first + 1.0);
        vec2 to = place - corner - offset - vec2(hashed_3(seed), hashed_3(seed.zxy));
        float side = hashed_3(vec3(cell, first + 2.0)) < 0.5 ? -1.0 : 1.0;
        phasor += side * impulse(dot(to, to), frequency * dot(to, vec2(cos(direction), sin(direction))));
    }
    return gabor_results(phasor, 0.25);
}
