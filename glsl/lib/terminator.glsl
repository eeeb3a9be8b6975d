// SPDX-License-Identifier: GPL-3.0-or-later
// How far the smooth surface that a mesh stands for lies above one of its triangles: shadow rays begin
// there, or triangles that turn from the light would be black where the smooth surface is lit (Hanika 2021,
// "Hacking the Shadow Terminator"). Uses the tables of triangles and of their normals.
#include "lib/triangle.glsl"

// The height of the quadratic surface through the corners that bends with their normals; 0: no higher.
float height_to_smooth(int triangle, vec3 position, vec3 shading) {
    Triangle t = triangle_at(triangle);
    CornerNormals n = corner_normals_at(triangle);
    vec3 ab = t.b - t.a, ac = t.c - t.a, share = corner_shares(t, position);
    float bent = dot(n.b - n.a, ab) * share.x * share.y + dot(n.c - n.a, ac) * share.x * share.z;
    bent += dot(n.c - n.b, t.c - t.b) * share.y * share.z;
    vec3 mean = share.x * n.a + share.y * n.b + share.z * n.c;
    return max(0.0, 0.5 * (dot(mean, shading) < 0.0 ? -bent : bent));
}

// Of it what a shadow ray begins above its place, by the cosines to the light; as in Cycles. It is done where
// these are below what the triangle's object has as "Geometry Offset"; 0: nowhere.
float terminator_share(int triangle, float shading, float geometric) {
    float below = corner_normals_at(triangle).terminator;
    if (!(below > 0.0)) return 0.0;
    return clamp(shading < below ? 2.0 - (geometric + shading) / below : 1.0 - geometric / below, 0.0, 1.0);
}
