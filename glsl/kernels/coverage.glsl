// SPDX-License-Identifier: GPL-3.0-or-later
// The share of the filter that lies on the visible point's own surface, of what cuts leave of it where that is known: 1
// inside, 1/2 at an edge, 1/4 in a corner. Dividing by its mean over passes removes the boundary bias, and, since the
// filter is integrated over the surface as it is, that of creases and curvature too.
//
// Each probe samples the filter on the tangent plane and looks for the surface above and below, where photons of it
// count: on the point's side, within 45 degrees of the plane. The
// inner filter's share comes from the same probes, weighted by inner over outer filter.
//
// Where the disc is cut, probes are sampled within the cuts, and tell what the surface lacks of the mass
// there, which is known: few probes would miss what narrow strips are left between two obstacles.
//
// A pixel's light is divided by its mean coverage, so where it shows two places, the one with less coverage would have
// less weight. Sums and coverage are both divided by what is expected of the coverage, which no photon and no other
// probe of the pass changes: by what cuts leave, and after the first passes by what `expecting` probes more find.
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

const int MOST_LAYERS = 16;  // that a probe may pass through
const float ONE_LAYER = 4.0 * SURFACE_OFFSET;  // so near to each other layers are one: rays meet the first
const int LOOKS = 8;  // every so many-th probe looks for all layers, of which all but the nearest count as much more
const float TOUCHES = 0.02;  // what is so near below another layer, over how far from the plane a probe begins
// Times as many probes where the filter is tilted, by a scale of more than MUCH: each weighs up to MOST_SCALE as much,
// and most end on the point's own triangle, where one of LOOKS costs a ray.
const int TILTED = 4;
const float MUCH = 1.5;
const float FLAT = 0.02;  // slope up to which a surface is taken for the nearest layer at once

// The point's own triangle, on which most probes end. Seen from the point in its plane, the sides with the
// triangle to their left: at (x, y) it is there that a x + b y + c > 0. Flags as Surface has them; what is behind it.
struct Own { vec3 first; vec3 second; vec3 third; int triangle; int flags; float behind; };

vec3 side_of(vec2 p, vec2 q) { return vec3(p.y - q.y, q.x - p.x, p.x * q.y - p.y * q.x); }

// 1 where a solid is behind a triangle, seen from one of its sides, -1 where it is in front of it, 0: neither.
float solid_behind(int triangle, float side) {
    return side * solids_at(triangle / 4).sides[triangle % 4];
}

Own own_triangle(int triangle, vec3 position, mat3 frame, float side) {
    Triangle corners = triangle_at(triangle);
    vec2 a = ((corners.a - position) * frame).xy;
    vec2 b = ((corners.b - position) * frame).xy;
    vec2 c = ((corners.c - position) * frame).xy;
    vec3 first = side_of(a, b), second = side_of(b, c), third = side_of(c, a);
    float turn = first.z + second.z + third.z < 0.0 ? -1.0 : 1.0;
    int flags = int(corner_normals_at(triangle).flags);
    return Own(turn * first, turn * second, turn * third, triangle, flags, solid_behind(triangle, side));
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

// What a probe met before, from above: how far above the plane; whether light gets through; whether below it one is
// in a solid.
struct Layer { float above; bool is_opaque; bool is_top; };

// Whether no light falls on the next layer: it is in a solid, as a leg in a seat, of whose outside a point is, or
// touches what is above it, as a board on another.
bool hides(Layer layer, float above, float height, bool is_outside) {
    return layer.is_opaque && ((layer.is_top && is_outside) || layer.above - above < TOUCHES * height);
}

// What probes sample of the tilted filter's mass within the cuts and of the inner one's; what the surface lacks of it.
struct Probed { vec2 mass; vec2 missing; };

// Sample the filter within the cuts, over the density of the sampled point. As photons do, all of the surface's layers
// on the point's side count, but hidden ones: the nearest to the plane, and, `others` times, what else is met; 0: that
// is not looked for.
Probed probe(Place place, Own own, mat3 frame, Cuts cuts, FilterTilt outer, FilterTilt inner, vec2 u, float radius, float others) {
    float r2 = radius * radius;
    vec3 normal = frame[2];
    vec2 direction = direction_at(u.y);
    float within = filter_mass(cut_reach2(cuts.first, cuts.second, radius, direction));
    float x2 = sample_filter(u.x * within), away = sqrt(x2 * r2);
    bool is_own = holds(own, direction * away);
    float mass = max(filter_shape(x2), 1.0e-30);
    vec2 sampled = vec2(1.0, inner_filter_shape(x2) / mass);
    sampled *= vec2(tilted_at(outer, direction * away), tilted_at(inner, direction * away));
    if (is_own && others == 0.0) return Probed(within * sampled, vec2(0.0));
    float height = away + SURFACE_OFFSET;  // within 45 degrees a surface strays no further
    vec3 origin = place.position + frame * vec3(direction * away, 0.0) + normal * height;
    // The point's own triangle needs no ray.
    vec2 nearest = is_own ? sampled : vec2(0.0), rest = vec2(0.0);
    int source = is_own ? own.triangle : -1;
    float left = 2.0 * height, above = height, nearness = is_own ? 0.0 : 1.0e10;
    Layer before = Layer(1.0e10, false, false);
    bool is_done = false;
    for (int layer = 0; layer < MOST_LAYERS && !is_done; layer++) {
        RayHit found = trace(origin, -normal, left, source);
        if (found.triangle < 0) break;
        Surface surface = surface_at(Hit(found.t, stored_triangle(found.triangle), found.u, found.v), -normal);
        above -= found.t;
        left -= found.t;
        if (is_own && above < 0.0 && before.above > 0.0) before = Layer(0.0, (own.flags & OPAQUE) != 0, own.behind > 0.0);
        bool is_known = abs(above - before.above) < ONE_LAYER || (is_own && abs(above) < ONE_LAYER);
        bool is_hidden = hides(before, above, height, own.behind >= 0.0);
        bool is_top = solid_behind(found.triangle, surface.side) > 0.0;
        before = Layer(above, (surface.flags & OPAQUE) != 0, is_top);
        bool is_lit = !is_known && !is_hidden && (surface.flags & PHOTONS_LAND) != 0;
        if (is_lit && stored_surface(surface.surface, surface.side) == place.surface
            && same_orientation(pack_direction(surface.geometric), normal)) {
            vec3 offset = surface.position - place.position;
            float at = dot(offset, offset) / r2;
            vec2 there = (offset * frame).xy;
            vec2 counts = vec2(filter_shape(at) * tilted_at(outer, there), inner_filter_shape(at) * tilted_at(inner, there));
            counts = at > 1.0 ? vec2(0.0) : counts / (mass * dot(surface.geometric, normal));
            bool is_nearest = abs(above) < nearness;
            rest += is_nearest ? nearest : counts;
            if (is_nearest) nearest = counts;
            nearness = min(nearness, abs(above));
            is_done = others == 0.0 && above <= FLAT * height;
            if (others == 0.0) left = 2.0 * above;  // what is further below the plane is not nearer
        }
        origin -= normal * found.t;
        source = found.triangle;
    }
    return Probed(within * sampled, within * (sampled - nearest - others * rest));
}

// The means of this pass's probes, and of those that tell what to expect, of the untilted filters; lanes share them.
void send_probes(
    Place place, Own own, bool is_held, mat3 frame, Cuts cuts, FilterTilt outer, FilterTilt inner, vec2 start,
    vec2 other_start, float radius, inout Probed sent, inout Probed expectant
) {
    int times = outer.scale > MUCH ? TILTED : 1, count = probes * times;
    FilterTilt tilt = outer, inner_tilt = inner;
    for (int i = lane(); i < count + expecting; i += LANES) {
        bool is_more = i >= count;
        uint number = is_more ? uint(i - count) : first_probe * uint(times) + uint(i);
        float others = !is_more && number % uint(LOOKS) == 0u ? float(LOOKS) : 0.0;
        if (is_held && others == 0.0) continue;
        if (is_more) tilt = inner_tilt = no_tilt();
        vec2 u = r2_sequence(is_more ? other_start : start, number);
        Probed probed = probe(place, own, frame, cuts, tilt, inner_tilt, u, radius, others);
        if (is_more) {
            expectant.missing += probed.missing / float(expecting);
        } else {
            sent.mass += probed.mass / float(count);
            sent.missing += probed.missing / float(count);
        }
    }
}

// The surface's share of the tilted filter, and what scales it, both over what is expected of the coverage: of what the
// cuts leave, the share that other probes find, as if one more had, and no less than what keeps one pass from
// outweighing the others. Where they find much, what is missing is taken from the mass that is known, elsewhere from
// the one that probes sampled: that is as noisy as what is missing, but with it.
vec2 share_and_scale(FilterTilt filter_tilt, float mass, float missing, float not_expected) {
    float found = 1.0, over = filter_tilt.known;
    if (expecting > 0) {
        found = clamp(1.0 - not_expected / max(filter_tilt.left, 1.0e-6), 0.0, 1.0);
        over = max(filter_tilt.left * (float(expecting) * found + 1.0) / float(expecting + 1), least_expected);
    }
    return vec2(mix(mass, filter_tilt.mass, found) - missing, filter_tilt.scale) / over;
}

void kernel() {
    Place place = load_place();
    bool is_gathering = is_place(place) && gathers(load_diffuse());
    FilterTilt outer = no_tilt(), inner = no_tilt();
    Probed sent = Probed(vec2(0.0), vec2(0.0)), expectant = sent;
    if (is_gathering) {
        Facing facing = load_facing();
        vec3 normal = facing.normal;
        // One sequence over all passes: the mean's error falls with the number of probes, not its root.
        uint number = uint(pixel_number(load_pixel().at));
        vec2 start = random4(seed, 0u, number, DIMENSION_COVERAGE + uint(depth)).xy;
        vec2 other_start = random4(seed, first_probe, number, DIMENSION_EXPECTED + uint(depth)).xy;
        float radius = radius_at(place.position, normal);
        Cuts cuts = load_cuts();
        mat3 frame = frame_about(normal);
        Own own = own_triangle(int(load_shading().triangle), place.position, frame, facing.side);
        bool is_held = holds_disc(own, radius);
        if (cuts.first != vec2(0.0)) {
            cut_tilts(cuts, is_held, cuts_of(own), radius, r2_sequence(start, first_probe), outer, inner);
        }
        send_probes(place, own, is_held, frame, cuts, outer, inner, start, other_start, radius, sent, expectant);
    }
    vec4 means = sum_over_lanes(vec4(sent.mass, sent.missing));
    vec2 lacks = sum_over_lanes(vec4(expectant.missing, 0.0, 0.0)).xy;
    if (!is_gathering) skip();
    vec2 share = share_and_scale(outer, means.x, means.z, lacks.x);
    vec2 inner_share = share_and_scale(inner, means.y, means.w, lacks.y);
    store_coverage(Coverage(share.x, inner_share.x, share.y, inner_share.y));
    store_tilt(Tilt(outer.tilt, inner.tilt));
}
