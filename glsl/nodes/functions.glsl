// SPDX-License-Identifier: GPL-3.0-or-later
// Powers, logarithms and angles of each channel by itself, as Blender's Math and Vector Math nodes have them: what
// has no value is 0. The numbers are those of addon/blender/export/arithmetic.py.
// Operands: a, b, [function].
#include "lib/constants.glsl"

// Of negative numbers to whole exponents alone.
vec3 power(vec3 a, vec3 b) {
    vec3 size = pow(abs(a), b);
    bvec3 is_odd = equal(abs(mod(b, vec3(2.0))), vec3(1.0));
    vec3 of_negative = mix(mix(vec3(0.0), size, equal(b, floor(b))), -size, is_odd);
    vec3 result = mix(size, of_negative, lessThan(a, vec3(0.0)));
    return mix(mix(result, vec3(0.0), equal(a, vec3(0.0))), vec3(1.0), equal(b, vec3(0.0)));
}

vec3 logarithm(vec3 a, vec3 base) {
    vec3 of_base = log(base);
    bvec3 is_none = bvec3(vec3(lessThanEqual(a, vec3(0.0))) + vec3(lessThanEqual(base, vec3(0.0))) + vec3(equal(of_base, vec3(0.0))));
    return mix(log(a) / of_base, vec3(0.0), is_none);
}

vec4 run_functions(vec4 first, vec4 second, vec4 function) {
    vec3 a = first.xyz, b = second.xyz, result = vec3(0.0);
    vec3 unit = clamp(a, -1.0, 1.0);
    switch (int(function.x)) {
    case 0: result = power(a, b); break;
    case 1: result = logarithm(a, b); break;
    case 2: result = sqrt(max(a, vec3(0.0))); break;
    case 3: result = mix(vec3(0.0), inversesqrt(max(a, vec3(1.0e-38))), greaterThan(a, vec3(0.0))); break;
    case 4: result = exp(a); break;
    case 5: result = sin(a); break;
    case 6: result = cos(a); break;
    case 7: result = tan(a); break;
    case 8: result = asin(unit); break;
    case 9: result = acos(unit); break;
    case 10: result = atan(a); break;
    case 11: result = mix(atan(a, b), vec3(0.0), equal(abs(a) + abs(b), vec3(0.0))); break;
    case 12: result = sinh(a); break;
    case 13: result = cosh(a); break;
    case 14: result = tanh(a); break;
    case 15: result = a * (PI / 180.0); break;
    case 16: result = a * (180.0 / PI); break;
    case 17: result = mix(mix(a, pow(max(a, vec3(0.0)), b), greaterThan(a, vec3(0.0))), vec3(1.0), equal(b, vec3(0.0))); break;
    }
    return vec4(result, 1.0);
}
