// SPDX-License-Identifier: GPL-3.0-or-later
// A unit normal of the object's space bent by a height that is known at the point and beside it, two ways away: as bump
// has it, where the surface was before it was displaced, as Cycles has it (svm_node_set_bump).
// Operands: normal, height along across, way_along, way_across.

vec4 run_object_bump(vec4 normal, vec4 height, vec4 way_along, vec4 way_across) {
    vec3 n = normal.xyz, of_along = cross(way_across.xyz, n), of_across = cross(n, way_along.xyz);
    float area = dot(way_along.xyz, of_along);
    vec3 gradient = (height.y - height.x) * of_along + (height.z - height.x) * of_across;
    vec3 bent = abs(area) * n - sign(area) * gradient;
    float l2 = dot(bent, bent);
    return l2 > 1.0e-30 && !isinf(l2) ? vec4(bent * inversesqrt(l2), 1.0) : normal;
}
