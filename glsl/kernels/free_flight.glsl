// SPDX-License-Identifier: GPL-3.0-or-later
// What is left of rays of the eye (EYE) and of photons (PHOTONS) where their way ends: at a surface, or where a medium
// scatters them before (SCATTERING). What is scattered there weighs as much as all that is lost; the lobe of the point
// (lib/scattering_point.glsl) leaves of it what is not absorbed.
#include "lib/media.glsl"
#ifdef WALKS
#include "lib/reach.glsl"
#endif
#ifdef SCATTERING
#include "lib/sampling.glsl"
#ifdef EYE
#include "lib/beams.glsl"
#include "lib/even.glsl"

const float THIN = 1.0e-3;  // optical depths below it lose light evenly all the way
// Of rays through media to a surface the least share that is scattered: by what thin ones lose alone, passes would have to
// be many to show them.
const float LEAST_SCATTERED = 0.25;
const float SHARE_OF_BEAMS = 0.5;  // of places where rays are scattered

// 1 - exp(-depth)
float lost_by(float depth) { return depth < THIN ? depth * (1.0 - 0.5 * depth) : 1.0 - exp(-depth); }

// The depth behind which light of one channel is lost on a way of a depth, and its density there.
float sample_lost(float depth, float u) { return depth < THIN ? u * depth : -log(1.0 - u * lost_by(depth)); }

float pdf_lost(float depth, float behind) { return depth < THIN ? 1.0 / depth : exp(-behind) / lost_by(depth); }

// x: whether the ray is scattered, and by which channel; y: where; z: whether that goes by beams, and by which.
vec3 numbers_of_flight() {
    uint dimension = DIMENSION_FLIGHT + 2u * uint(depth);
    return vec3(even_over_passes(dimension), even_over_passes(dimension + 1u).x);
}
#else
#include "lib/photon_number.glsl"
#include "lib/rng.glsl"
#endif

// Of light of a weight in each channel, what media scatter in the mean of what they take.
vec3 scattered_of(vec2 inside, vec3 weight) {
    Interior mean = interior_of(inside, vec3(0.0), true);
    return weight * mean.scattering / max(mean.extinction, vec3(1.0e-30));
}

// The place on its way where a ray is scattered; below 0: it is not, and comes to the end. Both weigh it anew.
#ifdef EYE
float scattered_at(vec2 inside, vec3 origin, vec3 direction, float way, inout vec3 weight) {
    vec3 depth = gone_along(inside, origin, direction, way, way, -1, 0.0).depth, left = weight * exp(-depth);
    vec3 lost = scattered_of(inside, weight) * vec3(lost_by(depth.r), lost_by(depth.g), lost_by(depth.b));
    float sum = lost.r + lost.g + lost.b, rest = left.r + left.g + left.b;
    // The more of it is left at the way's end, the likelier it comes there, also where nothing is, which alpha tells.
    float probability = sum > 0.0 ? max(sum / (sum + rest), LEAST_SCATTERED) : 0.0;
    vec3 u = numbers_of_flight();
    if (u.x >= probability) {
        weight = left / max(1.0 - probability, 1.0e-30);
        return -1.0;
    }
    int channel = channel_by(lost, u.x / probability);
    float target = sample_lost(depth[channel], u.y), far = way, density = 0.0;
    float by_beams = beam_count > 0 ? SHARE_OF_BEAMS : 0.0;
    if (u.z < by_beams) {
        far = sample_beams(origin, direction, way, vec2(u.z / by_beams, u.y));
        channel = -1;
    }
    Gone gone = gone_along(inside, origin, direction, way, far, channel, target);
    if (!(gone.t < LONGEST)) {  // by rounding: there is nothing so far
        weight = vec3(0.0);
        return -1.0;
    }
    for (int i = 0; i < 3; i++) {
        if (lost[i] > 0.0) density += lost[i] / sum * pdf_lost(depth[i], gone.depth[i]) * gone.extinction[i];
    }
    if (by_beams > 0.0) density = mix(density, pdf_beams(origin, direction, way, gone.t), by_beams);
    weight *= density > 0.0 ? gone.extinction * exp(-gone.depth) / (probability * density) : vec3(0.0);
    return gone.t;
}
#else
float scattered_at(vec2 inside, vec3 origin, vec3 direction, float way, inout vec3 weight) {
    // Where light of a channel is lost, drawn by what is scattered of it.
    vec3 shares = load_medium().scattered < float(volume_bounces) ? scattered_of(inside, weight) : vec3(0.0);
    float sum = shares.r + shares.g + shares.b;
    vec3 u = random4(seed, pass_index + photon_part(load_flux()), photon_number(load_flux()), DIMENSION_PHOTON_FLIGHT + uint(bounce)).xyz;
    int channel = sum > 0.0 ? channel_by(shares, u.x) : -1;
    Gone gone = gone_along(inside, origin, direction, way, way, channel, -log(1.0 - u.y));
    vec3 left = exp(-gone.depth);
    if (channel < 0 || !(gone.t < min(way, LONGEST))) {
        weight *= channel < 0 ? left : left * sum / max(dot(shares, left), 1.0e-30);
        return -1.0;
    }
    weight *= gone.extinction * left * sum / max(dot(shares, gone.extinction * left), 1.0e-30);
    return gone.t;
}
#endif
#endif

void kernel() {
    vec3 direction = load_direction().direction;
    if (direction == vec3(0.0)) skip();
    Hit hit = load_hit();
    Medium medium = load_medium();
    bool ends = is_hit(hit);
    if (!ends) medium.inside = vec2(air, 0.0);  // what an open mesh holds would not end: as in Cycles it is not there
    float far = ends ? hit.t : LONGEST;
#ifdef EYE
    Throughput carried = load_throughput();
    vec3 weight = carried.throughput;
#else
    Flux carried = load_flux();
    vec3 weight = carried.flux;
#endif
    vec3 origin = load_origin().position;
#ifdef SCATTERING
#ifdef WALKS
    // A ray that ends where a walk has come out has no way.
    float t = is_exit(load_direction().t_max) ? -1.0 : scattered_at(medium.inside, origin, direction, far, weight);
#else
    float t = scattered_at(medium.inside, origin, direction, far, weight);
#endif
    if (t >= 0.0) hit = scattered_hit(t);
    store_met(hit);
#else
    weight *= left_after(medium.inside, origin, direction, far);
#endif
    store_along(medium);
#ifdef EYE
    store_left(Throughput(weight, carried.density));
#else
    store_carried(Flux(weight, carried.photon));
#endif
}
