// SPDX-License-Identifier: GPL-3.0-or-later
// Flags of a triangle's material, as stage/geometry.py and native/src/coverage/mod.rs have them.
const int OPAQUE = 1;   // no lobe lets light through
const int PHOTONS_LAND = 2;  // photons may land there

// The shares of a triangle's corners at a position on it.
vec3 corner_shares(Triangle t, vec3 position) {
    vec3 ab = t.b - t.a, ac = t.c - t.a, at = position - t.a, area = cross(ab, ac);
    float all = dot(area, area), b = dot(cross(at, ac), area), c = dot(cross(ab, at), area);
    return clamp(vec3(all - b - c, b, c) / max(all, 1.0e-30), 0.0, 1.0);
}

// The unit normal of a triangle, by its edges. Scaled up before the cross product: a tiny triangle's area
// would underflow.
vec3 normal_of(vec3 ab, vec3 ac) {
    float scale = 1.0 / max(max(max(abs(ab.x), abs(ab.y)), abs(ab.z)), max(max(abs(ac.x), abs(ac.y)), abs(ac.z)));
    return normalize(cross(ab * scale, ac * scale));
}
