// SPDX-License-Identifier: GPL-3.0-or-later
// What a visible point is known to be on without a ray: its own triangle, with the neighbour in its plane that makes a
// quad of it (native/src/faces.rs). Uses the tables of triangles and faces.
#include "lib/bvh.glsl"
#include "lib/cuts.glsl"

// Seen from the point in its plane, the sides with the polygon to their left: at (x, y) it is there that
// a x + b y + c > 0. `is_lain_on`: something lies on it, on the point's side.
struct Own { mat4x3 sides; int triangle; bool is_lain_on; };

// Of a triangle, in place of a quad's side: all is to its left.
const vec3 NO_SIDE = vec3(0.0, 0.0, 1.0e-10);
const float NEAREST = 1.0e-10;  // a side is to the point at least, for its cut
const int LIES_ON_FRONT = 16, LIES_ON_BACK = 32;  // of a face's code
const float SMALL = 0.1;  // a polygon of so much of a disc's area

vec3 side_of(vec2 p, vec2 q) { return vec3(p.y - q.y, q.x - p.x, p.x * q.y - p.y * q.x); }

// 1 where a solid is behind a triangle, seen from one of its sides, -1 where it is in front of it, 0: neither.
float solid_behind(int triangle, float side) { return side * float(int(face_at(triangle).code) % 4 - 1); }

Own own_polygon(int triangle, float side, vec3 position, mat3 frame) {
    Triangle corners = triangle_at(triangle);
    Face face = face_at(triangle);
    int code = int(face.code), diagonal = code / 4 % 4;  // 0: none
    vec2 a = ((corners.a - position) * frame).xy;
    vec2 b = ((corners.b - position) * frame).xy;
    vec2 c = ((corners.c - position) * frame).xy;
    vec2 p = diagonal == 1 ? c : (diagonal == 2 ? a : b);
    vec2 q = diagonal == 1 ? a : (diagonal == 2 ? b : c);
    vec2 r = diagonal == 1 ? b : (diagonal == 2 ? c : a);
    vec2 s = ((face.fourth - position) * frame).xy;
    vec3 first = side_of(p, q), last = side_of(r, p);
    vec3 second = diagonal == 0 ? side_of(q, r) : side_of(q, s), third = diagonal == 0 ? NO_SIDE : side_of(s, r);
    float turn = first.z + second.z + third.z + last.z < 0.0 ? -1.0 : 1.0;
    mat4x3 sides = mat4x3(turn * first, turn * second, diagonal == 0 ? NO_SIDE : turn * third, turn * last);
    return Own(sides, triangle, (code & (side < 0.0 ? LIES_ON_BACK : LIES_ON_FRONT)) != 0);
}

bool holds(Own own, vec2 at) { return all(greaterThan(vec3(at, 1.0) * own.sides, vec4(0.0))); }

// Whether it is known where light falls on it: nothing lies there, and it is not so small beside a disc that knowing it
// is not worth what it takes.
bool is_known(Own own, float radius) {
    float area = 0.5 * (own.sides[0].z + own.sides[1].z + own.sides[2].z + own.sides[3].z);
    return !own.is_lain_on && area >= SMALL * PI * radius * radius;
}

bool holds_disc(Own own, float radius) {
    vec4 x = vec4(own.sides[0].x, own.sides[1].x, own.sides[2].x, own.sides[3].x);
    vec4 y = vec4(own.sides[0].y, own.sides[1].y, own.sides[2].y, own.sides[3].y);
    vec4 z = vec4(own.sides[0].z, own.sides[1].z, own.sides[2].z, own.sides[3].z);
    return all(greaterThan(z, radius * sqrt(x * x + y * y)));
}

// A side as a cut; one that the point is not to the left of cuts at the point.
vec2 cut_of(vec3 side) { return -side.xy / max(side.z, NEAREST); }

mat4x2 cuts_of(Own own) {
    return mat4x2(cut_of(own.sides[0]), cut_of(own.sides[1]), cut_of(own.sides[2]), cut_of(own.sides[3]));
}

// The filter's mass, x and y on the polygon and within the cuts in a direction, in radii, and in alpha its mass in
// another; the same of the inner filter. The means over CUT_DIRECTIONS of them are those of all.
void own_moments(mat4x2 sides, Cuts cuts, float radius, vec2 direction, vec2 other, out vec4 outer, out vec4 inner) {
    float x2 = both_reach2(cuts, sides, radius, direction), other_x2 = both_reach2(cuts, sides, radius, other);
    vec3 along = vec3(1.0, direction);
    outer = vec4(along * filter_moments(x2).xyy, filter_mass(other_x2));
    vec2 inner_x2 = min(vec2(x2, other_x2) / INNER_AREA, 1.0);
    inner = vec4(along * filter_moments(inner_x2.x).xyy, filter_mass(inner_x2.y));
}
