// SPDX-License-Identifier: GPL-3.0-or-later
// The share of the filter that lies on the visible point's own surface: 1 inside, 1/2 at an edge,
// 1/4 in a corner. Dividing by its mean over passes removes the boundary bias, and, since the filter
// is integrated over the surface as it is, that of creases and curvature too.
//
// Each probe samples the filter on the tangent plane and looks for the surface above and below. The
// inner filter's share comes from the same probes, weighted by inner over outer filter.
//
// Where the disc is cut, probes are sampled within the cuts, and tell what the surface lacks of the mass
// there, which is known: few probes would miss what narrow strips are left between two obstacles.
#include "lib/rng.glsl"
#include "lib/pixel.glsl"
#include "lib/sampling.glsl"
#include "lib/bvh.glsl"
#include "lib/surface.glsl"
#include "lib/density.glsl"
#include "lib/cuts.glsl"
#include "lib/radius.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"

const int MOST_LAYERS = 4;  // other surfaces that a probe may pass through
// Times as many probes where the filter is tilted, by a scale of more than MUCH: each weighs up to MOST_SCALE as much,
// and most end on the point's own triangle, which costs no ray.
const int TILTED = 4;
const float MUCH = 1.5;
const float FLAT = 0.02;    // slope up to which a surface is taken for the point's own at once

// The point's own triangle, on which most probes end: they need no ray. Seen from the point in its plane,
// the sides with the triangle to their left: at (x, y) it is there that a x + b y + c > 0.
struct Own { vec3 first; vec3 second; vec3 third; };

vec3 side_of(vec2 p, vec2 q) { return vec3(p.y - q.y, q.x - p.x, p.x * q.y - p.y * q.x); }

Own own_triangle(int triangle, vec3 position, mat3 frame) {
    Triangle corners = triangle_at(triangle);
    vec2 a = ((corners.a - position) * frame).xy;
    vec2 b = ((corners.b - position) * frame).xy;
    vec2 c = ((corners.c - position) * frame).xy;
    Own own = Own(side_of(a, b), side_of(b, c), side_of(c, a));
    float turn = own.first.z + own.second.z + own.third.z < 0.0 ? -1.0 : 1.0;
    return Own(turn * own.first, turn * own.second, turn * own.third);
}

bool holds(Own own, vec2 at) {
    vec3 p = vec3(at, 1.0);
    return dot(own.first, p) > 0.0 && dot(own.second, p) > 0.0 && dot(own.third, p) > 0.0;
}

bool holds_disc(Own own, float radius) {
    return own.first.z > radius * length(own.first.xy) && own.second.z > radius * length(own.second.xy)
        && own.third.z > radius * length(own.third.xy);
}

// Its sides as cuts; of no triangle, none is left of the disc.
mat3x2 cuts_of(Own own) {
    vec3 nearness = vec3(own.first.z, own.second.z, own.third.z);
    if (!(min(min(nearness.x, nearness.y), nearness.z) > 0.0)) return mat3x2(vec2(1.0e10), vec2(1.0e10), vec2(1.0e10));
    return mat3x2(-own.first.xy / nearness.x, -own.second.xy / nearness.y, -own.third.xy / nearness.z);
}

// Sample the filter within the cuts. What the surface lacks of the tilted filter's mass there, and of the inner
// one's, over the density of the sampled point. Of several layers the one nearest to the plane counts: in a
// fold of less than 45 degrees the first one met is the back of its other side.
vec2 probe(Place place, Own own, mat3 frame, Cuts cuts, FilterTilt outer, FilterTilt inner, vec2 u, float radius) {
    float r2 = radius * radius;
    vec3 normal = frame[2];
    vec2 direction = direction_at(u.y);
    float within = filter_mass(cut_reach2(cuts.first, cuts.second, radius, direction));
    float x2 = sample_filter(u.x * within), away = sqrt(x2 * r2);
    if (holds(own, direction * away)) return vec2(0.0);
    float mass = max(filter_shape(x2), 1.0e-30);
    float height = away + SURFACE_OFFSET;  // within 45 degrees a surface strays no further
    vec3 origin = place.position + frame * vec3(direction * away, 0.0) + normal * height;
    float left = 2.0 * height, above = height;
    float inner_mass = inner_filter_shape(x2) / mass;
    vec2 found_mass = vec2(0.0);
    int source = -1;
    for (int layer = 0; layer < MOST_LAYERS; layer++) {
        RayHit found = trace(origin, -normal, left, source);
        if (found.triangle < 0) break;
        Surface surface = surface_at(Hit(found.t, stored_triangle(found.triangle), found.u, found.v), -normal);
        above -= found.t;
        left -= found.t;
        if (stored_surface(surface.surface) == place.surface && same_orientation(pack_direction(surface.geometric), normal)) {
            vec3 offset = surface.position - place.position;
            float at = dot(offset, offset) / r2;
            vec2 there = (offset * frame).xy;
            vec2 counts = vec2(filter_shape(at) * tilted_at(outer, there), inner_filter_shape(at) * tilted_at(inner, there));
            found_mass = at > 1.0 ? vec2(0.0) : counts / (mass * dot(surface.geometric, normal));
            if (above <= FLAT * height) break;
            left = 2.0 * above;  // as far below the plane as this one is above it
        }
        origin -= normal * found.t;
        source = found.triangle;
    }
    vec2 sampled = vec2(tilted_at(outer, direction * away), inner_mass * tilted_at(inner, direction * away));
    return within * (sampled - found_mass);
}

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
    Facing facing = load_facing();
    vec3 normal = facing.normal;
    int triangle = int(load_shading().triangle);
    // One sequence over all passes: the mean's error falls with the number of probes, not its root.
    vec2 start = random4(seed, 0u, uint(pixel_number(load_pixel().at)), DIMENSION_COVERAGE + uint(depth)).xy;
    float radius = radius_at(place.position, normal);
    Cuts cuts = load_cuts();
    vec2 missing = vec2(0.0);  // of the filter, of the inner one
    mat3 frame = frame_about(normal);
    Own own = own_triangle(triangle, place.position, frame);
    FilterTilt outer = no_tilt(), inner = no_tilt();
    bool is_held = holds_disc(own, radius);
    if (cuts.first != vec2(0.0)) {
        cut_tilts(cuts, is_held, cuts_of(own), radius, r2_sequence(start, first_probe), outer, inner);
    }
    int times = outer.scale > MUCH ? TILTED : 1, count = probes * times;
    if (!is_held) {
        for (int i = 0; i < count; i++) {
            vec2 u = r2_sequence(start, first_probe * uint(times) + uint(i));
            missing += probe(place, own, frame, cuts, outer, inner, u, radius) / float(count);
        }
    }
    store_coverage(Coverage(outer.mass - missing.x, inner.mass - missing.y, outer.scale, inner.scale));
    store_tilt(Tilt(outer.tilt, inner.tilt));
}
