// SPDX-License-Identifier: GPL-3.0-or-later
// A world space normal from a colour, as Cycles has it (svm_node_normal_map): in tangent space (0), where `tangent`
// with the sign of its bitangent, and `normal`, are those of the object's space, interpolated; in the object's
// space (1) or the world's (2), or those with Y and Z turned round (3, 4), as Blender once had them: there `normal`
// is the world's, of which a strength below 1 leaves a part.
// Operands: colour, tangent, normal, strength, [space].
#include "lib/object_space.glsl"

vec4 run_normal_map(vec4 colour, vec4 tangent, vec4 normal, vec4 strength, vec4 space) {
    vec3 c = 2.0 * colour.xyz - 1.0, found;
    int wanted = int(space.x);
    if (wanted > 2) c.yz = -c.yz;
    if (wanted == 0) {
        if (tangent.w == 0.0) return vec4(shading_point.shading, 1.0);  // the mesh has no such UV map
        c.xy *= strength.x;
        c.z = mix(1.0, c.z, clamp(strength.x, 0.0, 1.0));
        c = c.x * tangent.xyz + c.y * tangent.w * cross(normal.xyz, tangent.xyz) + c.z * normal.xyz;
    }
    found = shading_point.side * ((wanted & 1) == 1 || wanted == 0 ? normal_in_world(c) : c / max(length(c), 1.0e-30));
    if (wanted > 0 && strength.x != 1.0) found = mix(normal.xyz, found, max(strength.x, 0.0));
    float l2 = dot(found, found);
    if (!(l2 > 1.0e-12) || isinf(l2)) return vec4(wanted > 0 ? normal.xyz : shading_point.shading, 1.0);
    return vec4(found * inversesqrt(l2), 1.0);
}
