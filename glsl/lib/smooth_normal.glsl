// SPDX-License-Identifier: GPL-3.0-or-later
// The smooth surface that stands for a triangle.

// Its unit normal at these shares of the triangle's corners, on the side of another normal, which it is if it is none.
vec3 smooth_normal(CornerNormals normals, vec3 share, vec3 geometric) {
    vec3 normal = share.x * normals.a + share.y * normals.b + share.z * normals.c;
    float l2 = dot(normal, normal);
    normal = l2 > 1.0e-30 ? normal * inversesqrt(l2) : geometric;
    return dot(normal, geometric) < 0.0 ? -normal : normal;
}
