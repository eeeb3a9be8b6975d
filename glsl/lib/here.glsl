// SPDX-License-Identifier: GPL-3.0-or-later
// The point that a material's program is asked about. Uses the tables of spaces and of corners' attributes.
#include "lib/hit.glsl"

struct Here {
    vec3 position;   // [scene units]
    vec3 geometric;  // unit normal of the triangle, on the ray's side
    vec3 shading;    // unit, on the same side
    vec3 to_viewer;  // unit
    float side;      // which that is: 1 outside, -1 inside
    float far;       // length of the ray [scene units]
    int triangle;
    vec3 corners;    // barycentric weights of the triangle's corners
    int surface;
};

Here here;

vec3 to_space(Space space, vec3 position) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(space.x, p), dot(space.y, p), dot(space.z, p));
}

mat3 linear_part(Space space) { return transpose(mat3(space.x.xyz, space.y.xyz, space.z.xyz)); }

Space world_space() { return space_at(0); }
Space object_space() { return space_at(here.surface + 1); }
