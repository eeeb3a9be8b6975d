// SPDX-License-Identifier: GPL-3.0-or-later
// The gather radius at every place of a surface: native/src/radius.rs. Uses the table radii: for each
// side two texels, its grid's origin and which number of the table its first node is, cells and their
// size; then the nodes, x fastest, four a texel.
#include "lib/table.glsl"

const float FACING = 0.5;

float node_radius(int at) { return texelFetch(radii, table_texel(at >> 2), 0)[at & 3]; }

float radius_on(int side, vec3 position) {
    vec4 origin = texelFetch(radii, ivec2(2 * side, 0), 0), extent = texelFetch(radii, ivec2(2 * side + 1, 0), 0);
    vec3 at = clamp((position - origin.xyz) / extent.w, vec3(0.0), extent.xyz);
    ivec3 cells = ivec3(extent.xyz), cell = min(ivec3(at), cells - 1);
    vec3 share = at - vec3(cell);
    int row = cells.x + 1, layer = row * (cells.y + 1);
    int first = int(origin.w) + cell.z * layer + cell.y * row + cell.x;
    vec4 x;
    for (int i = 0; i < 4; i++) {
        int at = first + (i & 1) * row + (i >> 1) * layer;
        x[i] = mix(node_radius(at), node_radius(at + 1), share.x);
    }
    vec2 y = mix(x.xz, x.yw, share.y);
    return mix(y.x, y.y, share.z) * shrink;
}

// Sides are +x, -x, +y, -y, +z, -z.
int side_of(int axis, vec3 normal) { return 2 * axis + (normal[axis] < 0.0 ? 1 : 0); }

// The smallest of the sides that a surface counts for.
float radius_at(vec3 position, vec3 normal) {
    float radius = 1.0e30;
    for (int axis = 0; axis < 3; axis++) {
        if (abs(normal[axis]) >= FACING) radius = min(radius, radius_on(side_of(axis, normal), position));
    }
    return radius;
}

// No less than radius_at there of any surface within 45 degrees of a normal. Within 15 degrees of an axis
// all of these count for its side; else each counts for one that is within 45 + 54.8 degrees.
float largest_radius_at(vec3 position, vec3 normal) {
    float radius = 0.0;
    for (int axis = 0; axis < 3; axis++) {
        if (abs(normal[axis]) >= 0.966) return radius_on(side_of(axis, normal), position);
        radius = max(radius, radius_on(side_of(axis, normal), position));
        if (abs(normal[axis]) < 0.18) radius = max(radius, radius_on(side_of(axis, -normal), position));
    }
    return radius;
}
