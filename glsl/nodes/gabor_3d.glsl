// SPDX-License-Identifier: GPL-3.0-or-later
// Gabor Texture of three dimensions, as Cycles 5.0 has it: x (and w) the value, y the phase, z the intensity.
// `orientation`: along the waves, of any length.
// Long to compile.
// Operands: vector, orientation, scale frequency anisotropy.
#include "lib/gabor.glsl"

vec3 gabor_direction(vec3 base, vec2 polar, float spread, vec4 seed) {
    if (spread == 0.0) return base;
    vec2 angles = polar + vec2(hashed_4(seed), hashed_4(seed.zxwy)) * PI * spread;
    return vec3(sin(angles.x) * vec2(cos(angles.y), sin(angles.y)), cos(angles.x));
}

vec4 run_gabor_3d(vec4 vector, vec4 orientation, vec4 options) {
    vec3 place = vector.xyz * options.x, corner = floor(place);
    vec2 phasor = vec2(0.0);
    float frequency = max(0.001, options.y), spread = 1.0 - clamp(options.z, 0.0, 1.0);
    float size = length(orientation.xyz);
    vec3 base = size > 0.0 ? orientation.xyz / size : vec3(0.0);
    // Inclination and azimuth; along z Cycles has no azimuth, here it is 0.
    float azimuth = base.xy == vec2(0.0) ? 0.0 : atan(base.y, base.x);
    vec2 polar = vec2(acos(clamp(base.z, -1.0, 1.0)), azimuth);
    for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x)
    for (int i = 0; i < IMPULSES; ++i) {
        vec3 offset = vec3(float(x), float(y), float(z)), cell = corner + offset;
        float first = float(3 * i);
        vec3 direction = gabor_direction(base, polar, spread, vec4(cell, first));
        vec4 seed = vec4(cell, first + 1.0);
        vec3 to = place - corner - offset - vec3(hashed_4(seed), hashed_4(seed.zxwy), hashed_4(seed.wzyx));
        float side = hashed_4(vec4(cell, first + 2.0)) < 0.5 ? -1.0 : 1.0;
        phasor += side * impulse(dot(to, to), frequency * dot(to, direction));
    }
    return gabor_results(phasor, 0.1767766953);  // 1 / (4 sqrt(2))
}
