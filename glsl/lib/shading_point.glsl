// SPDX-License-Identifier: GPL-3.0-or-later
// The shading point: where a material's program is evaluated, and for which ray. Uses the tables of spaces and of
// corners' attributes, and with BUMPS that of triangles: a bump asks for heights beside the point, a tenth of its
// footprint away.
#include "lib/hit.glsl"
#ifdef BUMPS
#include "lib/triangle.glsl"
#endif

struct ShadingPoint {
    vec3 position;   // [scene units]
    vec3 geometric;  // unit normal of the triangle, on the ray's side
    vec3 shading;    // unit, on the same side
    vec3 to_viewer;  // unit
    float side;      // which that is: 1 outside, -1 inside
    float far;       // length of the ray [scene units]
    int triangle;
    vec3 corners;    // barycentric weights of the triangle's corners
    int surface;
#ifdef BUMPS
    float footprint;  // [scene units]
    vec3 along;       // unit, in the triangle's plane
    vec3 across;      // and at a right angle to it
    vec3 corners_along;   // what a footprint along there changes of the weights
    vec3 corners_across;
#endif
};

ShadingPoint shading_point;

// Which ray asks: the camera's, a shadow ray, a diffuse or a glossy one; and how many scattered before it.
const vec4 CAMERA_RAY = vec4(1.0, 0.0, 0.0, 0.0), SHADOW_RAY = vec4(0.0, 1.0, 0.0, 0.0);
const vec4 DIFFUSE_RAY = vec4(0.0, 0.0, 1.0, 0.0), GLOSSY_RAY = vec4(0.0, 0.0, 0.0, 1.0);
vec4 asking = CAMERA_RAY;
float scattered = 0.0;
float come = 0.0;  // how far the ray has come that goes on behind what is transparent [scene units]

// Who sees a photon, or is lit by emissive surfaces, does so by a diffuse ray, mostly.
void ask_as_light() {
    asking = DIFFUSE_RAY;
    scattered = 1.0;
}

vec3 to_space(Space space, vec3 position) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(space.x, p), dot(space.y, p), dot(space.z, p));
}

mat3 linear_part(Space space) { return transpose(mat3(space.x.xyz, space.y.xyz, space.z.xyz)); }

// Where a value is asked for: so many footprints along and across from the point.
vec3 shifted_position(vec4 shift) {
#ifdef BUMPS
    vec3 offset = shift.x * shading_point.along + shift.y * shading_point.across;
    return shading_point.position + shading_point.footprint * offset;
#else
    return shading_point.position;
#endif
}

vec3 shifted_corners(vec4 shift) {
#ifdef BUMPS
    return shading_point.corners + shift.x * shading_point.corners_along + shift.y * shading_point.corners_across;
#else
    return shading_point.corners;
#endif
}

#ifdef BUMPS
// How wide a pixel is at a position, as the eye sees it.
float footprint_at(vec3 position) {
#ifdef FOOTPRINT
    vec3 way = position - eye;
    float l = max(length(way), 1.0e-30), cosine = max(0.1, pixel_width.z > 0.0 ? dot(way, view_axis) / l : 1.0);
#if FOOTPRINT > 1
    // Not looked at from there, but by way of other surfaces: so many times as far.
    return pixel_width.x + pixel_width.y * float(FOOTPRINT) * l;
#endif
    // On a flat film pixels look narrower from the eye beside its middle: the mean of both sides'.
    return pixel_width.x + pixel_width.y * l * cosine * sqrt(0.5 + 0.5 * cosine * cosine);
#else
    return 1.0e-3;
#endif
}

// What a way in the plane of a triangle changes of the weights of its corners.
vec3 change_of_corners(Triangle triangle, vec3 way) {
    vec3 ab = triangle.b - triangle.a, ac = triangle.c - triangle.a, area = cross(ab, ac);
    float b = dot(cross(way, ac), area), c = dot(cross(ab, way), area);
    return vec3(-b - c, b, c) / max(dot(area, area), 1.0e-30);
}

// Find what is beside a point. The axes are those of Cycles (make_orthonormals), for what is too fine to be
// seen looks alike then.
void look_about(inout ShadingPoint p) {
    vec3 n = p.geometric;
    bool is_diagonal = n.x == n.y && n.x == n.z;
    p.along = normalize(is_diagonal ? vec3(n.z - n.y, n.x + n.z, -n.y - n.x) : vec3(n.z - n.y, n.x - n.z, n.y - n.x));
    p.across = cross(n, p.along);
    p.footprint = footprint_at(p.position);
    Triangle triangle = triangle_at(p.triangle);
    // Behind a triangle Cycles takes its sides the other way round.
    p.corners_along = p.side * change_of_corners(triangle, p.footprint * p.along);
    p.corners_across = p.side * change_of_corners(triangle, p.footprint * p.across);
}
#endif

Space world_space() { return space_at(0); }
Space object_space() { return space_at(shading_point.surface + 1); }
