// SPDX-License-Identifier: GPL-3.0-or-later
// The share of the filter that lies on the visible point's own surface, of what cuts leave of it where that is known: 1
// inside, 1/2 at an edge, 1/4 in a corner. Dividing by its mean over passes removes the boundary bias, and, since the
// filter is integrated over the surface as it is, that of creases and curvature too.
//
// On the point's own flat polygon it is known, unless something lies on it; probes sample the rest, on the tangent
// plane, and look for the surface above and below, where photons of it count: on the point's side, within 45 degrees of
// the plane. The inner filter's share comes from the same probes, weighted by inner over outer filter. Where the disc
// is cut, probes are sampled within the cuts.
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
#include "lib/own.glsl"
#include "lib/radius.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"

const int MOST_LAYERS = 16;  // that a probe may pass through
const float ONE_LAYER = 4.0 * SURFACE_OFFSET;  // so near to each other layers are one: rays meet the first
const int LOOKS = 8;  // every so many-th probe looks for all layers, of which all but the nearest count as much more
const float TOUCHES = 0.02;  // what is so near below another layer, over how far from the plane a probe begins
// Times as many probes where the filter is tilted, by a scale of more than MUCH: each weighs up to MOST_SCALE as much.
const int TILTED = 4;
const float MUCH = 1.5;
// A probe is uncertain whose variance is so much of the squared coverage: then so many times as many more are sent.
const float UNCERTAIN = 3.0;
const int MORE = 2;
const float FLAT = 0.02;  // slope up to which a surface is taken for the nearest layer at once
const float LEVEL = 2.0e-3;  // slope of a quad at most (native/src/faces.rs), and what rounding adds

// What a probe met before, from above: how far above the plane; whether light gets through; whether below it one is
// in a solid.
struct Layer { float above; bool is_opaque; bool is_top; };

// Whether no light falls on the next layer: it is in a solid, as a leg in a seat, of whose outside a point is, or
// touches what is above it, as a board on another.
bool hides(Layer layer, float above, float height, bool is_outside) {
    return layer.is_opaque && ((layer.is_top && is_outside) || layer.above - above < TOUCHES * height);
}

// What probes sample of the filter's mass, x, and what of it they find, y, of the tilted filter and of the inner one;
// and what of both they find on other layers.
struct Probed { vec2 outer; vec2 inner; vec2 layers; };

Probed no_probe() { return Probed(vec2(0.0), vec2(0.0), vec2(0.0)); }

void add(inout Probed sum, Probed more) {
    sum = Probed(sum.outer + more.outer, sum.inner + more.inner, sum.layers + more.layers);
}

// A point, and where its probes look for its surface.
struct Disc {
    vec3 position;
    float surface;
    mat3 frame;
    float radius;
    Own own;
    bool own_is_known;  // where light falls on the own polygon
    int flags;  // of the own triangle, as Surface has them
    float behind;  // the own triangle: as solid_behind tells
};

Disc disc_about(Place place, Facing facing, int triangle, vec2 first_cut) {
    mat3 frame = frame_about(facing.normal);
    float radius = cut_radius(radius_at(place.position, facing.normal), first_cut);
    float behind = solid_behind(triangle, facing.side);
    Own own = own_polygon(triangle, facing.side, place.position, frame);
    int flags = int(corner_normals_at(triangle).flags);
    return Disc(place.position, place.surface, frame, radius, own, is_known(own, radius), flags, behind);
}

// Sample the filter within the cuts, and look for the surface there where that is not the own polygon, which needs no
// ray. As photons do, all of the surface's layers on the point's side count, but hidden ones: the nearest to the plane,
// and, `others` times, what else is met; 0: that is not looked for.
Probed probe(Disc disc, Cuts cuts, FilterTilt outer, FilterTilt inner, vec2 u, float others) {
    vec2 direction = direction_at(u.y);
    float within = filter_mass(cut_reach2(cuts.first, cuts.second, disc.radius, direction));
    float r2 = disc.radius * disc.radius, x2 = sample_filter(u.x * within), away = sqrt(x2 * r2);
    vec2 there = direction * away;
    bool is_own = disc.own_is_known && holds(disc.own, there);
    if (is_own && others == 0.0) return no_probe();
    float mass = max(filter_shape(x2), 1.0e-30);
    vec2 sampled = within * vec2(tilted_at(outer, there), tilted_at(inner, there));
    sampled.y *= inner_filter_shape(x2) / mass;
    vec3 normal = disc.frame[2];
    float height = away + SURFACE_OFFSET;  // within 45 degrees a surface strays no further
    vec3 origin = disc.position + disc.frame * vec3(there, 0.0) + normal * height;
    vec2 nearest = vec2(0.0), rest = vec2(0.0);
    int source = is_own ? disc.own.triangle : -1;
    float left = 2.0 * height, above = height, nearness = is_own ? 0.0 : 1.0e10;
    Layer before = Layer(1.0e10, false, false);
    bool is_done = false;
    for (int layer = 0; layer < MOST_LAYERS && !is_done; layer++) {
        RayHit found = trace(origin, -normal, left, source);
        if (found.triangle < 0) break;
        Surface surface = surface_at(Hit(found.t, stored_triangle(found.triangle), found.u, found.v), -normal);
        above -= found.t;
        left -= found.t;
        if (is_own && above < 0.0 && before.above > 0.0) {
            before = Layer(0.0, (disc.flags & OPAQUE) != 0, disc.behind > 0.0);
        }
        bool is_own_layer = is_own && abs(above) < max(ONE_LAYER, LEVEL * height);
        bool is_known = is_own_layer || abs(above - before.above) < ONE_LAYER;
        bool is_hidden = hides(before, above, height, disc.behind >= 0.0);
        bool is_top = solid_behind(found.triangle, surface.side) > 0.0;
        before = Layer(above, (surface.flags & OPAQUE) != 0, is_top);
        bool is_lit = !is_known && !is_hidden && (surface.flags & PHOTONS_LAND) != 0;
        if (is_lit && stored_surface(surface.surface, surface.side) == disc.surface
            && same_orientation(pack_direction(surface.geometric), normal)) {
            vec3 offset = surface.position - disc.position;
            float at = dot(offset, offset) / r2;
            vec2 met = (offset * disc.frame).xy;
            vec2 counts = vec2(filter_shape(at), inner_filter_shape(at));
            counts *= vec2(tilted_at(outer, met), tilted_at(inner, met));
            counts = at > 1.0 ? vec2(0.0) : within * counts / (mass * dot(surface.geometric, normal));
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
    if (is_own) sampled = nearest = vec2(0.0);  // that is known
    return Probed(vec2(sampled.x, nearest.x), vec2(sampled.y, nearest.y), others * rest);
}

// Whether a point needs more probes for its coverage not to be much noisier than its photons: `rest` is the mass that
// is not on its polygon, of which so many probes as were `asked` found a share.
bool is_uncertain(float own, float rest, float share, float asked) {
    share = (share * asked + 0.5) / (asked + 1.0);
    float covered = own + rest * share;
    return expecting > 0 && rest * share * (1.0 - share) > UNCERTAIN * covered * covered;
}

// What is expected of the coverage: in the first passes what the cuts leave, where that is known, later the own
// polygon's mass and the share that other probes find of the rest, as if one more had found what is not on the polygon,
// and no less than what keeps one pass from outweighing the others. Nothing that it divides depends on it.
float expected(FilterTilt filter_tilt, float own, float share, float asked) {
    if (expecting == 0) return filter_tilt.known;
    share = (asked * share + 1.0 - own) / (asked + 1.0);
    return max(own + max(filter_tilt.left - own, 0.0) * share, least_expected);
}

float share_of(vec2 probed) { return probed.x > 0.0 ? min(probed.y / probed.x, 1.0) : 1.0; }

void kernel() {
    Place place = load_place();
    bool is_gathering = is_place(place) && gathers(load_diffuse());
    if (!LANES_WAIT && !is_gathering) skip();
    FilterTilt outer = no_tilt(), inner = no_tilt();
    Disc disc;
    Cuts cuts = Cuts(vec2(0.0), vec2(0.0));
    vec4 starts = vec4(0.0);
    vec2 other_start = vec2(0.0);
    bool is_held = true;
    if (is_gathering) {
        Facing facing = load_facing();
        // One sequence over all passes: the mean's error falls with the number of probes, not its root.
        uint number = uint(pixel_number(load_pixel().at));
        starts = random4(seed, 0u, number, DIMENSION_COVERAGE + uint(depth));
        other_start = random4(seed, first_probe, number, DIMENSION_EXPECTED + uint(depth)).xy;
        cuts = load_cuts();
        disc = disc_about(place, facing, int(load_shading().triangle), cuts.first);
        is_held = disc.own_is_known && holds_disc(disc.own, disc.radius);
        if (cuts.first != vec2(0.0)) {
            vec2 turns = r2_sequence(starts.xy, first_probe);
            cut_tilts(cuts, is_held, cuts_of(disc.own), disc.radius, turns, outer, inner);
        }
    }
    // Probes that tell what to expect, and others; in a second round more, where these are uncertain. Were the rounds
    // known to be two, compilers would make two copies of the probe, and that takes twice the time.
    int times = outer.scale > MUCH ? TILTED : 1, asked = is_held ? 0 : expecting, count = probes * times, more = 0;
    uint pass_number = first_probe / uint(max(probes, 1));
    vec2 on_own = vec2(0.0), over = vec2(1.0);
    vec2 shares = vec2(1.0), layers = vec2(0.0);
    vec4 means = vec4(0.0);
    for (int round = 0; round < rounds; round++) {
        bool is_first = round == 0;
        Probed told = no_probe(), sent = no_probe();
        int all = is_first ? asked + count : more;
        if (!is_gathering) all = 0;
        for (int i = lane(); i < all; i += LANES) {
            bool tells = is_first && i < asked;
            uint number = first_probe * uint(times) + uint(i - asked);
            float others = is_first && !tells && number % uint(LOOKS) == 0u ? float(LOOKS) : 0.0;
            if (is_held && others == 0.0) continue;
            vec2 start = tells ? other_start : (is_first ? starts.xy : second_sequence(starts.xy, uint(i + 1)));
            vec2 u = r2_sequence(start, tells ? uint(i) : (is_first ? number : pass_number));
            FilterTilt tilt = outer, inner_tilt = inner;
            if (tells) tilt = inner_tilt = no_tilt();
            Probed probed = probe(disc, cuts, tilt, inner_tilt, u, others);
            if (tells) add(told, probed);
            else add(sent, probed);
        }
        means += sum_over_lanes(vec4(sent.outer, sent.inner));
        layers += sent.layers;
        if (is_first) {
            vec4 tells = sum_over_lanes(vec4(told.outer, told.inner) / float(max(expecting, 1)));
            shares = vec2(share_of(tells.xy), share_of(tells.zw));
            // The mass that is averaged and the one that divides are of other directions each.
            vec2 turns = second_sequence(starts.zw, pass_number);
            mat4x2 sides = cuts_of(disc.own);
            vec4 own = vec4(0.0), inner_own = vec4(0.0);
            int directions = is_held || !disc.own_is_known || expecting == 0 ? 0 : CUT_DIRECTIONS;
            for (int i = lane(); i < directions; i += LANES) {
                vec2 all_turns = (turns + float(i)) / float(CUT_DIRECTIONS);
                vec4 more_own, more_inner;
                vec2 direction = direction_at(all_turns.x), other = direction_at(all_turns.y);
                own_moments(sides, cuts, disc.radius, direction, other, more_own, more_inner);
                own += more_own / float(CUT_DIRECTIONS);
                inner_own += more_inner / float(CUT_DIRECTIONS);
            }
            own = sum_over_lanes(own);
            inner_own = sum_over_lanes(inner_own);
            vec2 beyond = tells.xz * float(expecting);  // the own polygon: so many were asked
            on_own.x = tilted_mass(outer, own.xyz, disc.radius);
            on_own.y = tilted_mass(inner, inner_own.xyz, disc.radius * sqrt(INNER_AREA));
            over.x = expected(outer, own.w, shares.x, beyond.x);
            over.y = expected(inner, inner_own.w, shares.y, beyond.y);
            if (!is_held && is_uncertain(own.w, outer.left - own.w, shares.x, beyond.x)) more = MORE * count;
        }
    }
    vec4 on_layers = sum_over_lanes(vec4(0.0, layers.x, 0.0, layers.y));
    means = means / float(count + more) + on_layers / float(count);
    if (!is_gathering) skip();
    // Where probes find much, what they lack is taken off the mass that is known, elsewhere off the one that they
    // sampled: that is as noisy, but with it.
    vec2 share = on_own + shares * (vec2(outer.mass, inner.mass) - on_own - means.xz) + means.yw;
    vec2 scale = vec2(outer.scale, inner.scale) / over;
    share /= over;
    store_coverage(Coverage(share.x, share.y, scale.x, scale.y));
    store_tilt(Tilt(outer.tilt, inner.tilt));
}
