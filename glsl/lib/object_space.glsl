// SPDX-License-Identifier: GPL-3.0-or-later
// Between the space of the point's object [m] and the world's.
#include "lib/shading_point.glsl"

// The linear part of the transform from world space [m] to the object's.
mat3 world_to_object() { return linear_part(object_space()) / world_space().x.x; }

vec3 direction_in_world(vec3 direction) { return inverse(world_to_object()) * direction; }

// Unit normals go with the inverse transpose, either way; zero stays zero.
vec3 normal_in_world(vec3 normal) {
    vec3 turned = normal * world_to_object();
    return turned * inversesqrt(max(dot(turned, turned), 1.0e-30));
}

vec3 normal_in_object(vec3 normal) {
    vec3 turned = normal * inverse(world_to_object());
    return turned * inversesqrt(max(dot(turned, turned), 1.0e-30));
}
