// SPDX-License-Identifier: GPL-3.0-or-later

// The unit normal of a triangle, by its edges. Scaled up before the cross product: a tiny triangle's area
// would underflow.
vec3 normal_of(vec3 ab, vec3 ac) {
    float scale = 1.0 / max(max(max(abs(ab.x), abs(ab.y)), abs(ab.z)), max(max(abs(ac.x), abs(ac.y)), abs(ac.z)));
    return normalize(cross(ab * scale, ac * scale));
}
