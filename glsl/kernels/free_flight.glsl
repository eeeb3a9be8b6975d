// SPDX-License-Identifier: GPL-3.0-or-later
// What is left of rays of the eye (EYE) and of photons (PHOTONS) where their way ends: at a surface, or where a medium
// scatters them before (SCATTERING), which is drawn by the share of light that it loses. What is scattered there weighs as
// much as all that is lost; the lobe of the point (lib/scattering_point.glsl) leaves of it what is not absorbed.
#include "lib/media.glsl"
#ifdef SCATTERING
#ifdef EYE
#include "lib/beams.glsl"
#include "lib/even.glsl"
#else
#include "lib/photon_number.glsl"
#include "lib/rng.glsl"
#endif

const float THIN = 1.0e-3;  // optical depths below it lose light evenly all the way
// Of the eye's rays through media to a surface the least share that is scattered: by what thin ones lose alone, passes would
// have to be many to show them.
const float LEAST_SCATTERED = 0.25;
const float SHARE_OF_BEAMS = 0.5;  // of places where the eye's rays are scattered

// 1 - exp(-depth)
float lost_by(float depth) { return depth < THIN ? depth * (1.0 - 0.5 * depth) : 1.0 - exp(-depth); }

// Where light of one channel is lost on a way, and its density there.
float sample_lost(float extinction, float far, float u) {
    float depth = extinction * far;
    return depth < THIN ? u * far : min(-log(1.0 - u * lost_by(depth)) / extinction, far);
}

float pdf_lost(float extinction, float far, float t) {
    float depth = extinction * far;
    return depth < THIN ? 1.0 / far : extinction * exp(-extinction * t) / lost_by(depth);
}

// x: whether the ray is scattered, and by which channel; y: where; z: whether that goes by beams, and by which.
vec3 numbers_of_flight() {
#ifdef EYE
    uint dimension = DIMENSION_FLIGHT + 2u * uint(depth);
    return vec3(even_over_passes(dimension), even_over_passes(dimension + 1u).x);
#else
    return random4(seed, pass_index, photon_number(load_flux()), DIMENSION_PHOTON_FLIGHT + uint(bounce)).xyz;
#endif
}

// Whether it may be scattered once more.
bool may_scatter(Medium medium) {
#ifdef EYE
    return true;  // else no ray was sent
#else
    return medium.scattered < float(volume_bounces);
#endif
}

// The place of a ray of this weight on its way of a length, if it is scattered there, which weighs it anew; below 0: it
// is not, which is likelier the more of it is left at the way's end.
float scattered_at(Interior inside, float far, bool ends, vec3 left, inout vec3 weight) {
    vec3 lost = vec3(0.0);  // to what scatters
    for (int i = 0; i < 3; i++) {
        if (!(inside.scattering[i] > 0.0)) continue;
        lost[i] = weight[i] * lost_by(inside.extinction[i] * far) * inside.scattering[i] / inside.extinction[i];
    }
    float sum = lost.r + lost.g + lost.b, rest = ends ? left.r + left.g + left.b : 0.0;
    if (!(sum > 0.0)) return -1.0;
    float probability = sum / (sum + rest);
#ifdef EYE
    probability = max(probability, LEAST_SCATTERED);
#endif
    vec3 u = numbers_of_flight();
    if (u.x >= probability) {
        weight /= 1.0 - probability;
        return -1.0;
    }
    float chosen = u.x / probability * sum;
    int channel = chosen < lost.r ? 0 : chosen < lost.r + lost.g ? 1 : 2;
    if (!(lost[channel] > 0.0)) channel = lost.b > 0.0 ? 2 : lost.g > 0.0 ? 1 : 0;  // by rounding
    float t = sample_lost(inside.extinction[channel], far, u.y), density = 0.0;
#ifdef EYE
    vec3 origin = load_origin().position, direction = load_direction().direction;
    float by_beams = beam_count > 0 ? SHARE_OF_BEAMS : 0.0;
    if (u.z < by_beams) t = sample_beams(origin, direction, far, vec2(u.z / by_beams, u.y));
#endif
    for (int i = 0; i < 3; i++) {
        if (lost[i] > 0.0) density += lost[i] / sum * pdf_lost(inside.extinction[i], far, t);
    }
#ifdef EYE
    if (by_beams > 0.0) density = mix(density, pdf_beams(origin, direction, far, t), by_beams);
#endif
    weight *= inside.extinction * exp(-inside.extinction * t) / (probability * density);
    return t;
}
#endif

void kernel() {
    vec3 direction = load_direction().direction;
    if (direction == vec3(0.0)) skip();
    Hit hit = load_hit();
    Medium medium = load_medium();
    bool ends = is_hit(hit);
    if (ends) {
        Triangle triangle = triangle_at(hit_triangle(hit));
        float side = dot(cross(triangle.b - triangle.a, triangle.c - triangle.a), direction) > 0.0 ? -1.0 : 1.0;
        medium.inside = inside_before(medium.inside, interior_behind(hit), side);
    } else {
        medium.inside = vec2(air, 0.0);  // what an open mesh holds would not end: as in Cycles it is not there
    }
    float far = ends ? hit.t : LONGEST;
    Interior inside = interior_of(medium.inside);
#ifdef EYE
    Throughput carried = load_throughput();
    vec3 weight = carried.throughput;
#else
    Flux carried = load_flux();
    vec3 weight = carried.flux;
#endif
    vec3 left = left_of(inside.extinction, far);
#ifdef SCATTERING
    float t = -1.0;
    if (may_scatter(medium)) t = scattered_at(inside, far, ends, weight * left, weight);
    if (t >= 0.0) hit = scattered_hit(t);
    else weight *= left;
    store_met(hit);
#else
    weight *= left;
#endif
    store_along(medium);
#ifdef EYE
    store_left(Throughput(weight, carried.density));
#else
    store_carried(Flux(weight, carried.photon));
#endif
}
