// SPDX-License-Identifier: GPL-3.0-or-later
// How the Mix node blends b with a, as Cycles 5.0 has it (kernel/svm/color_util.h): screen (0), overlay (1), divide
// (2), exclusion (3), dodge (4), burn (5), soft light (6).
// Operands: a, b, share, [blend].

// 1 - a, less by as much as b is bright.
vec3 screened(vec3 a, vec3 b, float t) { return 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a); }

vec4 run_blend(vec4 first, vec4 second, vec4 share, vec4 blend) {
    vec3 a = first.xyz, b = second.xyz, result = a;
    float t = share.x;
    switch (int(blend.x)) {
    case 0: result = screened(a, b, t); break;
    case 1:
        result = mix(1.0 - (1.0 - t + 2.0 * t * (1.0 - b)) * (1.0 - a), a * (1.0 - t + 2.0 * t * b), lessThan(a, vec3(0.5)));
        break;
    case 2: result = mix((1.0 - t) * a + t * a / b, a, equal(b, vec3(0.0))); break;
    case 3: result = max(mix(a, a + b - 2.0 * a * b, t), vec3(0.0)); break;
    case 4: {
        vec3 left = 1.0 - t * b;
        result = mix(min(a / left, vec3(1.0)), vec3(1.0), lessThanEqual(left, vec3(0.0)));
        result = mix(result, vec3(0.0), equal(a, vec3(0.0)));
        break;
    }
    case 5: {
        vec3 left = 1.0 - t + t * b;
        result = mix(clamp(1.0 - (1.0 - a) / left, 0.0, 1.0), vec3(0.0), lessThanEqual(left, vec3(0.0)));
        break;
    }
    case 6: result = mix(a, (1.0 - a) * b * a + a * (1.0 - (1.0 - b) * (1.0 - a)), t); break;
    }
    return vec4(result, 1.0);
}
