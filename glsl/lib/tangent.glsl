// SPDX-License-Identifier: GPL-3.0-or-later
// Where the tangent at a hit points. Uses the table of tangents.
#include "lib/hit.glsl"
#include "lib/sampling.glsl"

// The angle about a unit normal from the first column of its frame_about to the tangent's projection on the
// plane of the normal; 0 where there is none.
float tangent_angle(Hit hit, vec3 normal) {
    CornerTangents tangents = corner_tangents_at(hit_triangle(hit));
    vec3 tangent = (1.0 - hit.u - hit.v) * tangents.a + hit.u * tangents.b + hit.v * tangents.c;
    mat3 frame = frame_about(normal);
    vec2 along = vec2(dot(tangent, frame[0]), dot(tangent, frame[1]));
    return along == vec2(0.0) ? 0.0 : atan(along.y, along.x);
}
