// SPDX-License-Identifier: GPL-3.0-or-later
// A vector of tangent space, as Vector Displacement has it: x goes along the tangent, y along the normal, z along the
// bitangent of that sign. All of the object's space.
// Operands: vector, tangent, normal.

vec4 run_tangent_space(vec4 vector, vec4 tangent, vec4 normal) {
    vec3 bitangent = cross(normal.xyz, tangent.xyz);
    bitangent *= tangent.w * inversesqrt(max(dot(bitangent, bitangent), 1.0e-30));
    return vec4(vector.x * tangent.xyz + vector.y * normal.xyz + vector.z * bitangent, 1.0);
}
