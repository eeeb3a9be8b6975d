// SPDX-License-Identifier: GPL-3.0-or-later
// Run a material's program: made/nodes.glsl has the nodes of the scene's, what runs them, and `operand`, what a code
// stands for. Uses the tables of instructions and constants.
#include "lib/shading_point.glsl"
#include "lib/surface.glsl"
#include "lib/colour.glsl"

const int PARTS = 7;

bool is_given(float code) { return code != 0.0; }

// A part of a result in place of x, y and z.
vec4 part_of(vec4 value, int part) {
    if (part == 0) return value;
    if (part <= 2) return vec4(part == 1 ? value.x : value.y);
    if (part <= 4) return vec4(part == 3 ? value.z : value.w);
    return vec4(part == 5 ? luminance(value.xyz) : mean(value.xyz));
}

#include "made/nodes.glsl"

ShadingPoint shading_point_at(Hit hit, vec3 direction, Surface surface) {
    ShadingPoint found;
    found.position = surface.position;
    found.geometric = surface.geometric;
    found.shading = surface.shading;
    found.to_viewer = -direction;
    found.side = surface.side;
    found.far = hit.t;
    found.triangle = hit_triangle(hit);
    found.corners = vec3(1.0 - hit.u - hit.v, hit.u, hit.v);
    found.surface = int(surface.surface);
#ifdef BUMPS
    look_about(found);
#endif
    return found;
}

// Results as a surface can have them.
vec3 reflectance_from(float code, vec3 otherwise) {
    return is_given(code) ? clamp(operand(code).xyz, 0.0, 1.0) : otherwise;
}

// Radiance that is not negative, nor too much to be added up.
vec3 radiance_from(float code) { return clamp(operand(code).xyz, 0.0, 1.0e18); }

float number_from(float code, float otherwise) { return is_given(code) ? max(operand(code).x, 0.0) : otherwise; }

vec4 numbers_from(vec4 codes, vec4 otherwise) {
    return vec4(
        number_from(codes.x, otherwise.x), number_from(codes.y, otherwise.y),
        number_from(codes.z, otherwise.z), number_from(codes.w, otherwise.w));
}

// A unit normal that a program gives. As in Cycles it may point anywhere.
vec3 normal_from(float code, vec3 otherwise) {
    vec3 normal = operand(code).xyz;
    float l2 = dot(normal, normal);
    if (!is_given(code) || !(l2 > 1.0e-12) || isinf(l2)) return otherwise;
    return normal * inversesqrt(l2);
}
