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

// A disc that is cut to a strip has hardly any spread across it, and is not tilted there.
const float LEAST_SPREAD = 1.0e-3;  // [radii^2]
// As much as a tilted filter may be scaled: beside a wall it is 3.25, in a corner of two it would be 6.5, where
// noise would grow by more than bias falls.
const float MOST_SCALE = 3.5;
// Of what the cuts leave of a disc, the share on the point's own polygon that tilts it not at all, and the one
// that does so wholly. Elsewhere probes tell what is surface: where that is little, their noise, which a tilt
// makes larger, would drown it.
const vec2 KNOWN = vec2(0.3, 0.6);

// What the cuts leave of a disc is known from these shares of it on the point's own polygon on, and from these shares
// of the whole on: of a sliver few directions tell little.
const vec2 SURE = vec2(0.8, 1.0), BROAD = vec2(0.25, 0.45);

// How the filter is tilted about a cut disc: what lies at d in the frame about the normal counts
// scale (1 + tilt d) times as much. Then the middle of what counts is the point itself, and light that rises
// evenly towards the cut or away from it is as bright as there: the local linear estimate (Fan & Gijbels 1996),
// where the surface is what the cuts leave of the disc. `mass` is what counts within the cuts, as much as
// without a tilt; `left`: the share of the untilted filter that the cuts leave, of which the mass does not depend;
// `known`: that, or 1 where it does not tell what is surface.
struct FilterTilt { vec2 tilt; float scale; float mass; float left; float known; };

// From 0 at the first bound to 1 at the second.
float rise(vec2 bounds, float x) { return clamp((x - bounds.x) / (bounds.y - bounds.x), 0.0, 1.0); }

FilterTilt no_tilt() { return FilterTilt(vec2(0.0), 1.0, 1.0, 1.0, 1.0); }

// A filter's moments within the cuts, in radii: mass, x, y; xx, xy, yy.
struct CutMoments { vec3 first; vec3 second; };

// From moments; and from others that don't depend on them, for the mass of what is tilted by the former is to
// be right in the mean. `known`: the share of what the cuts leave on the point's own polygon.
FilterTilt tilt_of(CutMoments moments, CutMoments others, float radius, float known) {
    vec3 first = moments.first, second = moments.second;
    float sure = mix(1.0, first.x, rise(SURE, known) * rise(BROAD, first.x)), strength = rise(KNOWN, known);
    float least = LEAST_SPREAD * first.x, xx = second.x + least, yy = second.z + least, xy = second.y;
    float determinant = max(xx * yy - xy * xy, 1.0e-20);
    vec2 tilt = vec2(xy * first.z - yy * first.y, xy * first.y - xx * first.z) / determinant;
    float taken = -dot(tilt, first.yz), most = (1.0 - 1.0 / MOST_SCALE) * first.x;  // off the mass
    if (taken > most) strength *= most / taken;
    tilt *= strength;
    float scale = first.x / max(first.x - strength * taken, 1.0e-20);
    float mass = scale * (others.first.x + dot(tilt, others.first.yz));
    return FilterTilt(tilt / radius, scale, mass, first.x, sure);
}

// What moments of the untilted filter count, in its radii: mass, x and y.
float tilted_mass(FilterTilt tilt, vec3 moments, float radius) {
    return tilt.scale * (moments.x + radius * dot(tilt.tilt, moments.yz));
}

float tilted_at(FilterTilt tilt, vec2 at) { return tilt.scale * (1.0 + dot(tilt.tilt, at)); }

// The filter's moments and the inner filter's, either in its radii; `turn`, 0 to 1, moves the directions that
// are looked at.
void cut_moments(Cuts cuts, float radius, float turn, out CutMoments outer, out CutMoments inner) {
    outer = inner = CutMoments(vec3(0.0), vec3(0.0));
    vec2 direction = direction_at(turn / float(CUT_DIRECTIONS));
    float share = 1.0 / float(CUT_DIRECTIONS);
    for (int i = 0; i < CUT_DIRECTIONS; i++) {
        float x2 = cut_reach2(cuts.first, cuts.second, radius, direction);
        vec3 along = share * vec3(1.0, direction);
        vec3 squares = share * vec3(direction * direction.x, direction.y * direction.y);
        vec3 moments = filter_moments(x2), inner_moments = filter_moments(min(x2 / INNER_AREA, 1.0));
        outer = CutMoments(outer.first + along * moments.xyy, outer.second + squares * moments.z);
        inner = CutMoments(inner.first + along * inner_moments.xyy, inner.second + squares * inner_moments.z);
        direction = CUT_STEP * direction;
    }
}

// How far a polygon of these sides, as cuts, reaches in a direction, squared, in radii; 1 at most.
float side_reach2(mat4x2 sides, float radius, vec2 direction) {
    vec4 nearness = direction * sides;
    float most = max(max(nearness.x, nearness.y), max(nearness.z, nearness.w)) * radius;
    return most > 1.0 ? 1.0 / (most * most) : 1.0;
}

// The same of what is within the cuts, too.
float both_reach2(Cuts cuts, mat4x2 sides, float radius, vec2 direction) {
    return min(cut_reach2(cuts.first, cuts.second, radius, direction), side_reach2(sides, radius, direction));
}

// The mass of the filter within the cuts and other half planes.
float known_mass(Cuts cuts, mat4x2 sides, float radius, float turn) {
    float sum = 0.0;
    vec2 direction = direction_at(turn / float(CUT_DIRECTIONS));
    for (int i = 0; i < CUT_DIRECTIONS; i++) {
        sum += filter_mass(both_reach2(cuts, sides, radius, direction));
        direction = CUT_STEP * direction;
    }
    return sum / float(CUT_DIRECTIONS);
}

// The tilts of the filter within the cuts, and of the inner one; `is_held`: the disc is by the polygon of
// these sides, as cuts.
void cut_tilts(
    Cuts cuts, bool is_held, mat4x2 sides, float radius, vec2 turns, out FilterTilt outer, out FilterTilt inner
) {
    CutMoments moments, inner_moments, others, inner_others;
    cut_moments(cuts, radius, turns.x, moments, inner_moments);
    cut_moments(cuts, radius, turns.y, others, inner_others);
    CutMoments between, inner_between;
    cut_moments(cuts, radius, turns.y + 0.5, between, inner_between);
    others.first = 0.5 * (others.first + between.first);
    inner_others.first = 0.5 * (inner_others.first + inner_between.first);
    float known = 1.0;
    if (!is_held) known = known_mass(cuts, sides, radius, turns.x) / max(moments.first.x, 1.0e-20);
    outer = tilt_of(moments, others, radius, known);
    inner = tilt_of(inner_moments, inner_others, radius * sqrt(INNER_AREA), known);
}

// A tilt as a vector of the space about the normal: what lies at `offset` counts 1 + dot(offset, tilt).
vec3 tilt_in_space(vec2 tilt, vec3 normal) { return cut_in_space(tilt, normal); }
