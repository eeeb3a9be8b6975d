// SPDX-License-Identifier: GPL-3.0-or-later
// What of a visible point's surface lies about it, as triangles of its tangent plane: of these the filter's mass is
// known without probes, as native/src/outline.rs has it, too. Uses the tables of nodes and triangles.
#include "lib/bvh.glsl"
#include "lib/cuts.glsl"
#include "lib/place.glsl"
#include "lib/triangle.glsl"

// Triangles that are looked at, and that an outline may have. Where there are more the surface is finely divided: to
// sum all of them up would take longer than probes do.
const int OUTLINE_LOOKED_AT = 256;
const int MOST_IN_OUTLINE = 24;

// A triangle. Seen from the point in its plane, the sides with the triangle to their left: at (x, y) it is there
// that a x + b y + c > 0.
struct Flat { vec3 first; vec3 second; vec3 third; };

vec3 side_of(vec2 p, vec2 q) { return vec3(p.y - q.y, q.x - p.x, p.x * q.y - p.y * q.x); }

Flat flat_of(Triangle corners, vec3 position, mat3 frame) {
    vec2 a = ((corners.a - position) * frame).xy;
    vec2 b = ((corners.b - position) * frame).xy;
    vec2 c = ((corners.c - position) * frame).xy;
    Flat made = Flat(side_of(a, b), side_of(b, c), side_of(c, a));
    float turn = made.first.z + made.second.z + made.third.z < 0.0 ? -1.0 : 1.0;
    return Flat(turn * made.first, turn * made.second, turn * made.third);
}

bool holds(Flat own, vec2 at) {
    vec3 p = vec3(at, 1.0);
    return dot(own.first, p) > 0.0 && dot(own.second, p) > 0.0 && dot(own.third, p) > 0.0;
}

bool holds_disc(Flat own, float radius) {
    return own.first.z > radius * length(own.first.xy) && own.second.z > radius * length(own.second.xy)
        && own.third.z > radius * length(own.third.xy);
}

// Its sides as cuts; of no triangle, none is left of the disc.
mat3x2 cuts_of(Flat own) {
    vec3 nearness = vec3(own.first.z, own.second.z, own.third.z);
    if (!(min(min(nearness.x, nearness.y), nearness.z) > 0.0)) return mat3x2(vec2(1.0e10), vec2(1.0e10), vec2(1.0e10));
    return mat3x2(-own.first.xy / nearness.x, -own.second.xy / nearness.y, -own.third.xy / nearness.z);
}

// How far it is from the point, at least.
float nearest_side(Flat other) {
    vec3 away = -vec3(other.first.z, other.second.z, other.third.z)
        / vec3(length(other.first.xy), length(other.second.xy), length(other.third.xy));
    return max(max(away.x, away.y), away.z);
}

// The triangles of the point's surface about it that face the way it does: how many, or -1, where they are too many;
// the mass of the filters that they have within the cuts; and how many of them are at places of the plane. None is kept,
// which GPUs would have to do in memory.
int in_outline;
vec2 outline_mass;
const int MOST_PLACES = 8;
vec2 places[MOST_PLACES];
float outline_at[MOST_PLACES];  // 1: all of the plane counts where the outline is not known

// A disc, and the first direction in which the mass of its filters is looked at.
struct Outlined { Cuts cuts; FilterTilt outer; FilterTilt inner; float radius; vec2 direction; };

// The mass of the tilted filters in a direction up to a distance.
vec2 mass_up_to(Outlined disc, vec2 direction, float away) {
    float x2 = min(1.0, away * away / (disc.radius * disc.radius)), inner_x2 = min(1.0, x2 / INNER_AREA);
    if (disc.cuts.first == vec2(0.0)) return vec2(filter_mass(x2), filter_mass(inner_x2));
    vec3 whole = filter_moments(x2), within = filter_moments(inner_x2);
    float across = disc.radius * whole.y, inner_across = disc.radius * sqrt(INNER_AREA) * within.y;
    return vec2(disc.outer.scale * (whole.x + across * dot(disc.outer.tilt, direction)),
                disc.inner.scale * (within.x + inner_across * dot(disc.inner.tilt, direction)));
}

// From where to where a triangle is there in a direction, no farther than `reach`.
vec2 span_of(Flat there, vec2 direction, float reach) {
    vec3 rises = vec3(dot(there.first.xy, direction), dot(there.second.xy, direction), dot(there.third.xy, direction));
    vec3 level = vec3(there.first.z, there.second.z, there.third.z), met = -level / rises;
    vec3 from = mix(vec3(0.0), met, greaterThan(rises, vec3(0.0)));
    vec3 to = mix(vec3(reach), met, lessThan(rises, vec3(0.0)));
    bvec3 is_along = equal(rises, vec3(0.0)), is_beyond = lessThanEqual(level, vec3(0.0));
    if ((is_along.x && is_beyond.x) || (is_along.y && is_beyond.y) || (is_along.z && is_beyond.z)) return vec2(0.0);
    return vec2(max(max(from.x, from.y), max(from.z, 0.0)), min(min(to.x, to.y), min(to.z, reach)));
}

float reach_of(Outlined disc, vec2 direction) {
    return disc.radius * sqrt(cut_reach2(disc.cuts.first, disc.cuts.second, disc.radius, direction));
}

vec2 mass_on(Outlined disc, Flat there) {
    vec2 sum = vec2(0.0), direction = disc.direction;
    for (int i = 0; i < CUT_DIRECTIONS; i++) {
        vec2 span = span_of(there, direction, reach_of(disc, direction));
        if (span.y > span.x) {
            sum += mass_up_to(disc, direction, span.y);
            if (span.x > 0.0) sum -= mass_up_to(disc, direction, span.x);
        }
        direction = CUT_STEP * direction;
    }
    return sum / float(CUT_DIRECTIONS);
}

vec2 mass_within_cuts(Outlined disc) {
    if (disc.cuts.first == vec2(0.0)) return vec2(1.0);
    vec2 sum = vec2(0.0), direction = disc.direction;
    for (int i = 0; i < CUT_DIRECTIONS; i++) {
        sum += mass_up_to(disc, direction, reach_of(disc, direction));
        direction = CUT_STEP * direction;
    }
    return sum / float(CUT_DIRECTIONS);
}

void add_to_outline(Triangle triangle, Place place, Facing facing, mat3 frame, Outlined disc) {
    vec3 normal = facing.side * normal_of(triangle.b - triangle.a, triangle.c - triangle.a);
    if (stored_surface(triangle.surface) != place.surface || !(dot(normal, facing.normal) >= SAME_ORIENTATION)) return;
    Flat found = flat_of(triangle, place.position, frame);
    if (!(nearest_side(found) < disc.radius)) return;
    if (in_outline == MOST_IN_OUTLINE) {
        in_outline = -1;
        return;
    }
    in_outline++;
    outline_mass += mass_on(disc, found);
    for (int i = 0; i < MOST_PLACES; i++) outline_at[i] += holds(found, places[i]) ? 1.0 : 0.0;
}

void look_for_outline(Place place, Facing facing, mat3 frame, Outlined disc) {
    vec3 reach = vec3(disc.radius + SURFACE_OFFSET), low = place.position - reach, high = place.position + reach;
    int stack[BVH_STACK];
    stack[0] = 0;
    int depth = 1, looked_at = 0;
    while (depth > 0) {
        Node both = node_at(stack[--depth]);
        for (int side = 0; side < 2; side++) {
            bool left = side == 0;
            vec3 box_low = left ? both.left_low : both.right_low, box_high = left ? both.left_high : both.right_high;
            if (any(greaterThan(box_low, high)) || any(lessThan(box_high, low))) continue;
            int first = int(left ? both.left_first : both.right_first);
            int count = int(left ? both.left_count : both.right_count);
            if (count == 0 && depth < BVH_STACK) stack[depth++] = first;
            for (int i = first; i < first + count; i++) {
                Triangle triangle = triangle_at(i);
                vec3 a = triangle.a, b = triangle.b, c = triangle.c;
                if (any(greaterThan(min(min(a, b), c), high)) || any(lessThan(max(max(a, b), c), low))) continue;
                if (++looked_at > OUTLINE_LOOKED_AT) in_outline = -1;
                else add_to_outline(triangle, place, facing, frame, disc);
                if (in_outline < 0) return;
            }
        }
    }
}

// Find the outline, and how many of its triangles are at `places`. What it lacks of the filters' mass within the cuts.
vec2 find_outline(Place place, Facing facing, mat3 frame, Outlined disc) {
    in_outline = 0;
    outline_mass = vec2(0.0);
    for (int i = 0; i < MOST_PLACES; i++) outline_at[i] = 0.0;
    look_for_outline(place, facing, frame, disc);
    if (in_outline > 0) return mass_within_cuts(disc) - outline_mass;
    for (int i = 0; i < MOST_PLACES; i++) outline_at[i] = 1.0;
    return vec2(0.0);
}
