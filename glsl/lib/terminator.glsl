// SPDX-License-Identifier: GPL-3.0-or-later
// How far the smooth surface that a mesh stands for lies above one of its triangles: shadow rays begin
// there, or triangles that turn from the light would be black where the smooth surface is lit (Hanika 2021,
// "Hacking the Shadow Terminator"). Uses the tables of triangles and of their normals.
#include "lib/triangle.glsl"

// How far the plane through a corner that stands on its normal is above a place, or if the others are above that plane the
// one that is as high as they are.
float height_of_corner(vec3 corner, vec3 normal, vec3 one, vec3 other, vec3 place) {
    float above = max(max(dot(one - corner, normal), dot(other - corner, normal)), 0.0);
    return max(dot(corner - place, normal) + above, 0.0);
}

vec3 unit_or_none(vec3 normal) {
    float l2 = dot(normal, normal);
    return l2 > 0.0 ? normal * inversesqrt(l2) : normal;
}

// The height of the quadratic surface through the corners that bends with their normals, and at least of the lowest of
// the corners' planes, which is above the triangle where that surface is below it; as in Cycles.
float height_to_smooth(int triangle, vec3 position, vec3 shading) {
    Triangle t = triangle_at(triangle);
    CornerNormals n = corner_normals_at(triangle);
    n.a = unit_or_none(n.a);
    n.b = unit_or_none(n.b);
    n.c = unit_or_none(n.c);
    vec3 share = corner_shares(t, position), mean = share.x * n.a + share.y * n.b + share.z * n.c;
    float side = dot(mean, shading) < 0.0 ? -1.0 : 1.0;
    float bent = dot(n.b - n.a, t.b - t.a) * share.x * share.y + dot(n.c - n.a, t.c - t.a) * share.x * share.z;
    bent += dot(n.c - n.b, t.c - t.b) * share.y * share.z;
    vec3 place = share.x * t.a + share.y * t.b + share.z * t.c;
    float least = height_of_corner(t.a, side * n.a, t.b, t.c, place);
    least = min(least, height_of_corner(t.b, side * n.b, t.a, t.c, place));
    least = min(least, height_of_corner(t.c, side * n.c, t.a, t.b, place));
    return max(least, 0.5 * side * bent) * length(mean);
}

// Of it what a shadow ray begins above its place, by the cosines to the light; as in Cycles. It is done where
// these are below what the triangle's object has as "Geometry Offset"; 0: nowhere.
float terminator_share(int triangle, float shading, float geometric) {
    float below = corner_normals_at(triangle).terminator;
    if (!(below > 0.0)) return 0.0;
    return clamp(shading < below ? 2.0 - (geometric + shading) / below : 1.0 - geometric / below, 0.0, 1.0);
}
