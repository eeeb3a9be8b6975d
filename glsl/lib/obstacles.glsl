// SPDX-License-Identifier: GPL-3.0-or-later
// What stands on a visible point's surface, as native/src/cuts.rs finds it, too. Uses the tables of nodes
// and triangles.
#include "lib/bvh.glsl"
#include "lib/sampling.glsl"
#include "lib/density.glsl"
#include "lib/place.glsl"
#include "lib/triangle.glsl"

// How far above the tangent plane obstacles are looked for, in radii: at two levels, so that neither what
// is low is missed, such as a rug, nor what ends a little above the floor, such as a door; not at once on
// the plane, where triangles of other surfaces may lie, and cross it by rounding. A lower upper
// level lets light leak under doors again in later passes, whose discs are smaller.
const vec2 LIFTS = vec2(0.01, 0.2);
// What a second obstacle stands out from the first cut at least, in radii, unless it is behind the point:
// more than rounding does where a wall's next triangle goes on along the cut.
const float MARGIN = 0.02;

// Triangles about a disc at most: where there are more, it is not cut, for all of them would have to be
// looked at, which rough ground would take several times as long for; more lower no error.
const int MOST_LOOKED_AT = 128;

struct Disc {
    vec3 position;
    mat3 frame;  // about the normal
    float radius;
    vec2 levels;  // heights above it at which obstacles are looked for
    float surface;
};

Disc disc_at(vec3 position, vec3 normal, float radius, float surface) {
    return Disc(position, frame_about(normal), radius, 4.0 * SURFACE_OFFSET + LIFTS * radius, surface);
}

// A triangle about a disc: its corners from the disc's position, and their heights; its bounds; its surface.
struct Near { vec3 a; vec3 b; vec3 c; vec3 heights; vec3 low; vec3 high; float surface; };

Near near_triangle(Disc disc, int triangle) {
    Triangle corners = triangle_at(triangle);
    vec3 low = min(min(corners.a, corners.b), corners.c), high = max(max(corners.a, corners.b), corners.c);
    vec3 a = corners.a - disc.position, b = corners.b - disc.position, c = corners.c - disc.position;
    vec3 normal = disc.frame[2], heights = vec3(dot(a, normal), dot(b, normal), dot(c, normal));
    return Near(a, b, c, heights, low, high, corners.surface);
}

bool crosses(Near near, float level) {
    bvec3 above = greaterThan(near.heights, vec3(level));
    return any(above) && !all(above);
}

// Light falls on a triangle of the disc's own surface that bends up slowly as it does on the disc.
bool bends_slowly(Disc disc, Near near) {
    if (near.surface != disc.surface) return false;
    return abs(dot(normal_of(near.b - near.a, near.c - near.a), disc.frame[2])) >= SAME_ORIENTATION;
}

// Where a triangle that crosses a level does so, from and to, in the disc's frame.
vec4 segment_at(Disc disc, Near near, float level) {
    bvec3 above = greaterThan(near.heights, vec3(level));
    // The corner that is alone on its side first.
    if (above.x == above.z) near = Near(near.b, near.c, near.a, near.heights.yzx, near.low, near.high, near.surface);
    else if (above.x == above.y) near = Near(near.c, near.a, near.b, near.heights.zxy, near.low, near.high, near.surface);
    vec2 lone = (near.a * disc.frame).xy;
    vec2 share = (level - near.heights.x) / (near.heights.yz - near.heights.x);
    vec2 from = lone + ((near.b * disc.frame).xy - lone) * share.x;
    return vec4(from, lone + ((near.c * disc.frame).xy - lone) * share.y);
}

// Move `nearest`, at the square distance `least`, to the nearest point of what a cut leaves of a segment.
void approach(vec4 segment, vec2 cut, float most, inout vec2 nearest, inout float least) {
    vec2 from = segment.xy, to = segment.zw;
    float begin = 0.0, end = 1.0;
    if (cut != vec2(0.0)) {
        float at_from = dot(from, cut), at_to = dot(to, cut);
        if (at_from >= most && at_to >= most) return;
        float met = (most - at_from) / (at_to - at_from);
        if (at_from >= most) begin = met;
        else if (at_to >= most) end = met;
    }
    vec2 way = to - from;
    float foot = min(max(-dot(from, way) / max(dot(way, way), 1.0e-30), begin), end);
    vec2 at = from + way * foot;
    float d2 = dot(at, at);
    // Of points at one distance always the same, in whatever order the triangles come.
    bool first = nearest != vec2(0.0) && (at.x < nearest.x || (at.x == nearest.x && at.y < nearest.y));
    if (d2 > 0.0 && (d2 < least || (d2 == least && first))) {
        nearest = at;
        least = d2;
    }
}

// The cut at the nearest obstacle on the disc, of those that `cut`, if not zero, leaves; zero if there is none,
// or too much to look at.
vec2 nearest_cut(Disc disc, vec2 cut) {
    vec3 normal = disc.frame[2];
    vec3 middle = disc.position + normal * (0.5 * (disc.levels.x + disc.levels.y));
    // Grown by what positions are rounded.
    vec3 reach = disc.radius * sqrt(max(vec3(0.0), 1.0 - normal * normal))
        + abs(normal) * (0.5 * (disc.levels.y - disc.levels.x)) + SURFACE_OFFSET;
    vec3 low = middle - reach, high = middle + reach;
    float most = max(0.0, 1.0 - MARGIN * disc.radius * length(cut));
    vec2 nearest = vec2(0.0);
    float least = disc.radius * disc.radius;
    int stack[BVH_STACK];
    stack[0] = 0;
    int depth = 1, looked_at = 0, at = 0, in_leaves = 0, from_left = 0, first_left = 0, first_right = 0;
    while (true) {  // by nodes and triangles, as trace does
        if (at == in_leaves) {
            if (depth == 0) break;
            Node both = node_at(stack[--depth]);
            bool left = !any(greaterThan(both.left_low, high)) && !any(lessThan(both.left_high, low));
            bool right = !any(greaterThan(both.right_low, high)) && !any(lessThan(both.right_high, low));
            int left_count = int(both.left_count), right_count = int(both.right_count);
            first_left = int(both.left_first);
            first_right = int(both.right_first);
            if (left && left_count == 0 && depth < BVH_STACK) stack[depth++] = first_left;
            if (right && right_count == 0 && depth < BVH_STACK) stack[depth++] = first_right;
            from_left = left ? left_count : 0;
            in_leaves = from_left + (right ? right_count : 0);
            at = 0;
        }
        if (at < in_leaves) {
            Near near = near_triangle(disc, at < from_left ? first_left + at : first_right + at - from_left);
            at++;
            if (any(greaterThan(near.low, high)) || any(lessThan(near.high, low))) continue;
            if (++looked_at > MOST_LOOKED_AT) return vec2(0.0);
            bool at_low = crosses(near, disc.levels.x), at_high = crosses(near, disc.levels.y);
            if (!(at_low || at_high) || bends_slowly(disc, near)) continue;
            if (at_low) approach(segment_at(disc, near, disc.levels.x), cut, most, nearest, least);
            if (at_high) approach(segment_at(disc, near, disc.levels.y), cut, most, nearest, least);
        }
    }
    return nearest / least;
}
