// SPDX-License-Identifier: GPL-3.0-or-later
// The share of the filter that lies on the visible point's own surface: 1 inside, 1/2 at an edge,
// 1/4 in a corner. Dividing by its mean over passes removes the boundary bias, and, since the filter
// is integrated over the surface as it is, that of creases and curvature too.
//
// Each probe samples the filter on the tangent plane and looks for the surface above and below. The
// inner filter's share comes from the same probes, weighted by inner over outer filter.
//
// What triangles about the point cover is known without probes, which then only tell what is there besides, and what
// is not: few probes would meet what is narrower than the disc, as a chair's leg, by chance, and the quotient would be
// a firefly where they didn't.
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
#include "lib/outline.glsl"
#include "lib/radius.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"

const int MOST_LAYERS = 4;  // other surfaces that a probe may pass through
// Times as many probes where the filter is tilted, by a scale of more than MUCH: each weighs up to MOST_SCALE as much,
// and most end on the point's own triangle, which costs no ray.
const int TILTED = 4;
const float MUCH = 1.5;
const float FLAT = 0.02;    // slope up to which a surface is taken for the point's own at once

// A point of the plane by the filter within the cuts, in what direction and how far; the filter's mass there.
struct Probe { vec2 direction; float x2; float within; };

Probe probe_of(Cuts cuts, vec2 u, float radius) {
    vec2 direction = direction_at(u.y);
    float within = filter_mass(cut_reach2(cuts.first, cuts.second, radius, direction));
    return Probe(direction, sample_filter(u.x * within), within);
}

vec2 place_of(Probe probe, float radius) { return probe.direction * sqrt(probe.x2) * radius; }

// What of the tilted filter's mass is there on the surface, and of the inner one's, less that of `known` times the plane,
// over the density of the sampled point. Of several layers the one nearest to the plane counts: in a fold of less than
// 45 degrees the first one met is the back of its other side.
vec2 probe(
    Place place, Flat own, mat3 frame, Probe sampled, FilterTilt outer, FilterTilt inner, float radius, float known
) {
    float r2 = radius * radius, x2 = sampled.x2, within = sampled.within, away = sqrt(x2) * radius;
    vec3 normal = frame[2];
    vec2 direction = sampled.direction, at_plane = direction * away;
    float mass = max(filter_shape(x2), 1.0e-30), inner_mass = inner_filter_shape(x2) / mass;
    vec2 of_plane = vec2(tilted_at(outer, at_plane), inner_mass * tilted_at(inner, at_plane));
    // Most probes end on the point's own triangle: they need no ray.
    if (holds(own, at_plane)) return within * (1.0 - known) * of_plane;
    float height = away + SURFACE_OFFSET;  // within 45 degrees a surface strays no further
    vec3 origin = place.position + frame * vec3(at_plane, 0.0) + normal * height;
    float left = 2.0 * height, above = height;
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
    return within * (found_mass - known * of_plane);
}

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
    Facing facing = load_facing();
    vec3 normal = facing.normal;
    int triangle = int(load_shading().triangle);
    // One sequence over all passes: the mean's error falls with the number of probes, not its root.
    vec4 start = random4(seed, 0u, uint(pixel_number(load_pixel().at)), DIMENSION_COVERAGE + uint(depth));
    float radius = radius_at(place.position, normal);
    Cuts cuts = load_cuts();
    mat3 frame = frame_about(normal);
    Flat own = flat_of(triangle_at(triangle), place.position, frame);
    FilterTilt outer = no_tilt(), inner = no_tilt();
    bool is_held = holds_disc(own, radius);
    if (cuts.first != vec2(0.0)) {
        cut_tilts(cuts, is_held, cuts_of(own), radius, r2_sequence(start.xy, first_probe), outer, inner);
    }
    int times = outer.scale > MUCH ? TILTED : 1, count = probes * times;
    vec2 share = vec2(outer.mass, inner.mass);  // of the filter, of the inner one
    if (!is_held) {
        bool is_outlined = count <= MOST_PLACES;
        if (is_outlined) {
            for (int i = 0; i < MOST_PLACES; i++) {
                places[i] = place_of(probe_of(cuts, r2_sequence(start.xy, first_probe + uint(i)), radius), radius);
            }
            vec2 direction = direction_at(r2_sequence(start.zw, first_probe).y / float(CUT_DIRECTIONS));
            share -= find_outline(place, facing, frame, Outlined(cuts, outer, inner, radius, direction));
        }
        for (int i = 0; i < count; i++) {
            Probe sampled = probe_of(cuts, r2_sequence(start.xy, first_probe * uint(times) + uint(i)), radius);
            float known = is_outlined ? outline_at[i] : 1.0;
            share += probe(place, own, frame, sampled, outer, inner, radius, known) / float(count);
        }
    }
    store_coverage(Coverage(share.x, share.y, outer.scale, inner.scale));
    store_tilt(Tilt(outer.tilt, inner.tilt));
}
