// SPDX-License-Identifier: GPL-3.0-or-later
// Checker Texture's factor, as Cycles 5.0 has it (intern/cycles/kernel/svm/checker.h), in xyz and w: 1 where Color1 is.
// Operands: vector, scale.

vec4 run_checker(vec4 vector, vec4 options) {
    // As Cycles does, so that whole numbers fall on one side.
    vec3 at = floor((vector.xyz * options.x + 0.000001) * 0.999999);
    bvec3 odd = equal(ivec3(at) & 1, ivec3(1));
    return vec4((odd.x == odd.y) == odd.z ? 1.0 : 0.0);
}
