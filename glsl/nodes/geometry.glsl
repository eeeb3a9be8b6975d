// SPDX-License-Identifier: GPL-3.0-or-later
// What a point knows of itself: its position in world space [m] (0) or its object's (1); its shading normal
// in world space (2) or its object's (3); its geometric normal (4); the direction to the viewer (5), all unit
// and on the ray's side; whether that side is the back (6); the weights of a triangle's corners (7).
// Operands: [which].

// Normals go with the inverse transpose.
vec3 to_normal_space(Space space, vec3 normal) {
    vec3 turned = transpose(inverse(linear_part(space))) * normal;
    return turned * inversesqrt(max(dot(turned, turned), 1.0e-30));
}

vec4 run_geometry(vec4 which) {
    int wanted = int(which.x);
    vec3 value = here.corners.yzx;  // the weights of the second and of the third corner first
    if (wanted == 0) value = to_space(world_space(), here.position);
    else if (wanted == 1) value = to_space(object_space(), here.position);
    else if (wanted == 2) value = here.shading;
    else if (wanted == 3) value = to_normal_space(object_space(), here.shading);
    else if (wanted == 4) value = here.geometric;
    else if (wanted == 5) value = here.to_viewer;
    else if (wanted == 6) value = vec3(here.side < 0.0 ? 1.0 : 0.0);
    return vec4(value, 1.0);
}
