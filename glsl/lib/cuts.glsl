// SPDX-License-Identifier: GPL-3.0-or-later
// Where a visible point's disc ends: half planes, each a vector in the frame about the normal, towards its
// border and as long as that is near: 1 / distance. Zero cuts nothing.
#include "lib/sampling.glsl"
#include "lib/density.glsl"

const int CUT_DIRECTIONS = 16;  // in which it is asked how far a cut disc reaches
const mat2 CUT_STEP = mat2(0.9238795, 0.38268343, -0.38268343, 0.9238795);  // turns one to the next

// A cut as a vector of the space about the normal: `dot(offset, cut) > 1` for what it cuts off.
vec3 cut_in_space(vec2 cut, vec3 normal) { return frame_about(normal) * vec3(cut, 0.0); }

// How far a disc of this radius reaches in a direction of its plane, squared, in radii.
float cut_reach2(vec2 first, vec2 second, float radius, vec2 direction) {
    float nearness = max(dot(direction, first), dot(direction, second)) * radius;
    return nearness > 1.0 ? 1.0 / (nearness * nearness) : 1.0;
}

vec2 direction_at(float turns) { return vec2(cos(2.0 * PI * turns), sin(2.0 * PI * turns)); }

// The share of the filter's mass within the cuts, and of the inner filter's; `turn`, 0 to 1, moves the
// directions that are looked at.
vec2 cut_masses(vec2 first, vec2 second, float radius, float turn) {
    vec2 sum = vec2(0.0), direction = direction_at(turn / float(CUT_DIRECTIONS));
    for (int i = 0; i < CUT_DIRECTIONS; i++) {
        float x2 = cut_reach2(first, second, radius, direction);
        sum += vec2(filter_mass(x2), filter_mass(min(x2 / INNER_AREA, 1.0)));
        direction = CUT_STEP * direction;
    }
    return sum / float(CUT_DIRECTIONS);
}
