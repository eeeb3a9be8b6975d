// SPDX-License-Identifier: GPL-3.0-or-later
// Whether an edge of the triangle is as near as half a wire's width [m]: 1, else 0.
// Operands: size, [shift].
#include "lib/triangle.glsl"

vec4 run_wireframe(vec4 size, vec4 shift) {
    Triangle at = triangle_at(shading_point.triangle);
    vec3 place = shifted_position(shift), corners[3] = vec3[](at.a, at.b, at.c);
    float half_width = 0.5 * size.x / world_space().x.x, wire = 0.0;
    for (int i = 0; i < 3; i++) {
        vec3 edge = corners[(i + 1) % 3] - corners[i], away = cross(edge, place - corners[i]);
        if (dot(away, away) < half_width * half_width * dot(edge, edge)) wire = 1.0;
    }
    return vec4(vec3(wire), 1.0);
}
