// SPDX-License-Identifier: GPL-3.0-or-later
// What Blender's Vector Math node has of vectors as a whole, as Cycles 5.0 evaluates it (kernel/svm/math_util.h):
// cross product (0), a projected on b (1), a reflected (2) or refracted (3) at normal b, of index c; a where b and c
// are opposed, else -a (4), dot product (5), distance (6), length (7), a as long as 1 (8).
// Operands: a, b, c, [operation].

vec3 unit_or_zero(vec3 v) {
    float l = length(v);
    return l > 0.0 ? v / l : vec3(0.0);
}

vec4 run_vector(vec4 first, vec4 second, vec4 third, vec4 operation) {
    vec3 a = first.xyz, b = second.xyz, result = vec3(0.0);
    switch (int(operation.x)) {
    case 0: result = cross(a, b); break;
    case 1: result = dot(b, b) > 0.0 ? b * (dot(a, b) / dot(b, b)) : vec3(0.0); break;
    case 2: result = reflect(a, unit_or_zero(b)); break;
    case 3: result = refract(a, unit_or_zero(b), third.x); break;
    case 4: result = dot(third.xyz, b) < 0.0 ? a : -a; break;
    case 5: result = vec3(dot(a, b)); break;
    case 6: result = vec3(distance(a, b)); break;
    case 7: result = vec3(length(a)); break;
    case 8: result = unit_or_zero(a); break;
    }
    return vec4(result, 1.0);
}
