// SPDX-License-Identifier: GPL-3.0-or-later
// From world space to the object's: a point (0), a direction (1), a unit normal (2); and the other way (3, 4, 5).
// Operands: vector, [way].
#include "lib/object_space.glsl"

vec4 run_space(vec4 vector, vec4 way) {
    Space world = world_space(), own = object_space();
    vec3 centre = vec3(world.x.w, world.y.w, world.z.w), offset = vec3(own.x.w, own.y.w, own.z.w), v = vector.xyz;
    switch (int(way.x)) {
    case 0: v = world_to_object() * (v - centre) + offset; break;
    case 1: v = world_to_object() * v; break;
    case 2: v = normal_in_object(v); break;
    case 3: v = direction_in_world(v - offset) + centre; break;
    case 4: v = direction_in_world(v); break;
    case 5: v = normal_in_world(v); break;
    }
    return vec4(v, 1.0);
}
