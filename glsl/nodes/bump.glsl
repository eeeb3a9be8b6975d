// SPDX-License-Identifier: GPL-3.0-or-later
// A normal bent by a height [m] that is known at the point and beside it, `width` footprints along and across: by the
// gradient on the surface (Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU"), as Cycles has it
// (svm_node_set_bump). `distance` is what heights are multiplied by. World space.
// Operands: normal, height along across, strength distance width.

vec4 run_bump(vec4 normal, vec4 height, vec4 amount) {
#ifdef BUMPS
    vec3 n = normal.xyz, of_along = cross(shading_point.across, n), of_across = cross(n, shading_point.along);
    float metres = shading_point.footprint * world_space().x.x, area = dot(shading_point.along, of_along);
    vec3 gradient = (height.y - height.x) * of_along + (height.z - height.x) * of_across;
    vec3 bent = amount.z * metres * abs(area) * n - amount.y * sign(area) * gradient;
    float l2 = dot(bent, bent);
    if (!(l2 > 1.0e-30) || isinf(l2)) return normal;
    return vec4(normalize(mix(n, bent * inversesqrt(l2), max(amount.x, 0.0))), 1.0);
#else
    return normal;
#endif
}
