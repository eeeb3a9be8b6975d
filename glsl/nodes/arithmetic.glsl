// SPDX-License-Identifier: GPL-3.0-or-later
// Arithmetic with each channel by itself, as Blender's Math and Vector Math nodes have it: what has no value is 0; and
// what other nodes do to each channel.
// The numbers of operations are those of addon/blender/export/arithmetic.py.
// Operands: a, b, c, [operation].

vec3 ratio(vec3 a, vec3 b) { return mix(a / b, vec3(0.0), equal(b, vec3(0.0))); }

vec3 wrapped(vec3 a, vec3 high, vec3 low) {
    vec3 range = high - low;
    return mix(a - range * floor((a - low) / range), low, equal(range, vec3(0.0)));
}

vec3 smooth_minimum(vec3 a, vec3 b, vec3 reach) {
    vec3 h = ratio(max(reach - abs(a - b), vec3(0.0)), reach);
    return min(a, b) - h * h * h * reach / 6.0;
}

vec3 ping_pong(vec3 a, vec3 scale) {
    vec3 back = abs(fract((a - scale) / (scale * 2.0)) * scale * 2.0 - scale);
    return mix(back, vec3(0.0), equal(scale, vec3(0.0)));
}

vec3 smoother_step(vec3 x) { return x * x * x * (x * (x * 6.0 - 15.0) + 10.0); }

vec4 run_arithmetic(vec4 first, vec4 second, vec4 third, vec4 operation) {
    vec3 a = first.xyz, b = second.xyz, c = third.xyz, result = vec3(0.0);
    switch (int(operation.x)) {
    case 0: result = a + b; break;
    case 1: result = a - b; break;
    case 2: result = a * b; break;
    case 3: result = ratio(a, b); break;
    case 4: result = a * b + c; break;
    case 5: result = a + c * (b - a); break;
    case 6: result = abs(a); break;
    case 7: result = min(a, b); break;
    case 8: result = max(a, b); break;
    case 9: result = vec3(lessThan(a, b)); break;
    case 10: result = vec3(greaterThan(a, b)); break;
    case 11: result = sign(a); break;
    case 12: result = vec3(lessThanEqual(abs(a - b), max(c, vec3(1.0e-5)))); break;
    case 13: result = smooth_minimum(a, b, c); break;
    case 14: result = -smooth_minimum(-a, -b, c); break;
    case 15: result = floor(a + 0.5); break;
    case 16: result = floor(a); break;
    case 17: result = ceil(a); break;
    case 18: result = trunc(a); break;
    case 19: result = fract(a); break;
    case 20: result = mix(a - b * trunc(a / b), vec3(0.0), equal(b, vec3(0.0))); break;
    case 21: result = mix(a - b * floor(a / b), vec3(0.0), equal(b, vec3(0.0))); break;
    case 22: result = wrapped(a, b, c); break;
    case 23: result = floor(ratio(a, b)) * b; break;
    case 24: result = ping_pong(a, b); break;
    case 25: result = min(max(a, b), c); break;
    case 26: result = smoothstep(vec3(0.0), vec3(1.0), a); break;
    case 27: result = smoother_step(clamp(a, 0.0, 1.0)); break;
    }
    return vec4(result, 1.0);
}
