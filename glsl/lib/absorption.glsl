// SPDX-License-Identifier: GPL-3.0-or-later
// What light loses on its way inside meshes (Beer and Lambert). What it goes into adds to what is there, and what it
// leaves is taken away again: so meshes may overlap, and hold others. Uses the tables of triangles and materials.
#include "lib/hit.glsl"
#include "lib/triangle.glsl"

// Of what is left of one mesh when another is taken away, less than this share of that is rounding.
const float ABSORPTION_ROUNDING = 1.0e-5;

// Of the mesh whose surface a ray meets.
vec3 absorption_at(Hit hit) { return material_at(int(triangle_at(hit_triangle(hit)).material)).absorption; }

// On a ray's way to a surface of a mesh that absorbs so much. One that meets the back has come from inside it, also where
// the camera or a lamp is in it. `side`: Facing's.
vec3 absorption_before(Medium medium, vec3 own, float side) {
    return side < 0.0 ? max(medium.absorption, own) : medium.absorption;
}

// On its way behind the surface.
Medium medium_behind(Medium medium, Hit hit, float side) {
    vec3 own = absorption_at(hit);
    if (side > 0.0) return Medium(medium.absorption + own, medium.sent);
    vec3 left = absorption_before(medium, own, side) - own;
    return Medium(mix(left, vec3(0.0), lessThan(left, ABSORPTION_ROUNDING * own)), medium.sent);
}

vec3 left_by_absorption(Medium medium, Hit hit, float side) {
    return exp(-hit.t * absorption_before(medium, absorption_at(hit), side));
}
