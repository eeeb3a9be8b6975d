// SPDX-License-Identifier: GPL-3.0-or-later
// A vector, turned by Euler angles about X, then Y, then Z [rad] (0), back by these (1), or about an axis of any
// length by an angle (2); about no axis it stays.
// Operands: vector, turn, angle, [way].

vec3 turned_about(vec3 v, vec3 axis, float angle) {
    float c = cos(angle), s = sin(angle);
    return c * v + s * cross(axis, v) + (1.0 - c) * dot(axis, v) * axis;
}

vec4 run_rotate(vec4 vector, vec4 turn, vec4 angle, vec4 way) {
    vec3 v = vector.xyz, t = turn.xyz;
    if (int(way.x) == 2) {
        float l = length(t);
        return vec4(l > 0.0 ? turned_about(v, t / l, angle.x) : v, 1.0);
    }
    vec3 c = cos(t), s = sin(t);
    mat3 x = mat3(1.0, 0.0, 0.0, 0.0, c.x, s.x, 0.0, -s.x, c.x);
    mat3 y = mat3(c.y, 0.0, -s.y, 0.0, 1.0, 0.0, s.y, 0.0, c.y);
    mat3 z = mat3(c.z, s.z, 0.0, -s.z, c.z, 0.0, 0.0, 0.0, 1.0);
    mat3 all = z * y * x;
    return vec4(int(way.x) == 1 ? v * all : all * v, 1.0);
}
