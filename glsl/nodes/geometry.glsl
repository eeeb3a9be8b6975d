// SPDX-License-Identifier: GPL-3.0-or-later
// What a point knows of itself: its position in world space [m] (0) or its object's (1); its shading normal
// in world space (2) or its object's (3); its geometric normal (4); the direction to the viewer (5), all unit
// and on the ray's side; whether that side is the back (6); the weights of a triangle's first two corners (7); the normal
// of the smooth surface in the object's space (8). `shift`: where positions, weights and the latter are asked for, see
// shifted_position.
// Operands: [which], [shift].
#include "lib/object_space.glsl"
#ifdef BUMPS
#include "lib/smooth_normal.glsl"
#endif

// The shading normal, or the mesh's beside the point.
vec3 shading_at(vec4 shift) {
#ifdef BUMPS
    if (shift.xy != vec2(0.0)) {
        CornerNormals normals = corner_normals_at(shading_point.triangle);
        return smooth_normal(normals, shifted_corners(shift), shading_point.geometric);
    }
#endif
    return shading_point.shading;
}

vec4 run_geometry(vec4 which, vec4 shift) {
    int wanted = int(which.x);
    vec3 value = vec3(shifted_corners(shift).xy, 0.0);
    if (wanted == 0) value = to_space(world_space(), shifted_position(shift));
    else if (wanted == 1) value = to_space(object_space(), shifted_position(shift));
    else if (wanted == 2) value = shading_point.shading;
    else if (wanted == 3) value = normal_in_object(shading_point.shading);
    else if (wanted == 4) value = shading_point.geometric;
    else if (wanted == 5) value = shading_point.to_viewer;
    else if (wanted == 6) value = vec3(shading_point.side < 0.0 ? 1.0 : 0.0);
    else if (wanted == 8) value = normal_in_object(shading_at(shift));
    return vec4(value, 1.0);
}
