// SPDX-License-Identifier: GPL-3.0-or-later
// The walk below a surface of light that goes the other way, from where it comes out to where it went in: free flights,
// all directions alike where they end, until one meets the surface again. Chiang, Kutz & Burley 2016, "Practical and
// Controllable Subsurface Scattering for Production Path Tracing", with what Cycles makes of the albedo.
#define ONE_SURFACE
#include "lib/bvh.glsl"
#include "lib/sampling.glsl"
#include "lib/triangle.glsl"
#include "lib/even.glsl"
#include "lib/colour.glsl"
#include "lib/packed_walk.glsl"

const int MOST_FLIGHTS = 256;
const float LEAST_OF_WALK = 1.0e-4;  // of a path that has less nothing is left
const int WALKS_A_RAY = 4;
const float BY_WEIGHT = 0.5;  // of the rays follow a channel by its weight, others any
const float SHORT = 0.1;  // mean free paths that a walk begins below the surface, at most
const float LEAST_ALBEDO = 0.2;  // of one scattering; less is taken off the weight

// Where the walk has left the surface, and what it weighs: nothing, if it has not.
struct Exit { vec3 position; vec3 normal; vec3 weight; };

// What one scattering leaves, for surfaces of such an albedo; `is_later`: by d'Eon's inversion ("A Hitchhiker's Guide to
// Multiple Scattering", sec. 53), as Cycles has it since Blender 5.2, instead of its fit before.
vec3 albedo_of_scattering(vec3 albedo, bool is_later) {
    if (is_later) {
        vec3 root = sqrt(9.59217 + 41.6808 * albedo + 17.7126 * albedo * albedo);
        vec3 s = 4.20863 * albedo - root + 4.09712;
        return clamp(1.0 - s * s, 0.0, 0.999999);
    }
    vec3 few = 0.496310210422 * pow(atan(4.23500904 * albedo), vec3(2.40602999408));
    vec3 many = 1.8260523782 * pow(atan(5.1124679 * albedo), vec3(1.09686102424));
    return clamp(mix(many, few, pow(albedo, vec3(0.25))), 0.0, 0.999999);
}

// What walks begin with: a channel, whose light they follow, with a probability; `weight`: of the ray, which has the lobe's
// colour.
struct Inside {
    vec3 entry;
    vec3 geometric;
    vec3 direction;
    int triangle;
    vec3 extinction;
    vec3 scattering;
    vec3 weight;
    int channel;
    vec3 shares;  // probabilities of the channels
};

// The walk of a number of WALKS_A_RAY. What it weighs in each channel is by the balance heuristic over those that might have
// made it (Wilkie et al. 2014, "Hero Wavelength Spectral Sampling").
Exit walk_once(Inside inside, int walk, uint number, uint dimension) {
    Exit none = Exit(inside.entry, inside.geometric, vec3(0.0));
    vec3 position = inside.entry, direction = inside.direction;
    float lift = SURFACE_OFFSET * max(1.0, largest(abs(position)));
    position -= inside.geometric * min(lift, SHORT / largest(inside.extinction));
    // Of the light that is not absorbed, and the densities of the way by each channel, but for a factor.
    vec3 kept = vec3(1.0), density = vec3(1.0);
    int source = inside.triangle;
    for (int flight = 0; flight < MOST_FLIGHTS; flight++) {
        vec4 u = random4(seed, pass_index, number, dimension + uint(flight));
        if (flight == 0) u.y = (float(walk) + u.y) / float(WALKS_A_RAY);
        else direction = direction_from_versine(2.0 * u.z, 2.0 * PI * u.w);
        float far = -log(1.0 - u.y) / inside.extinction[inside.channel];
        RayHit found = trace(position, direction, far, source);
        bool is_met = found.triangle >= 0;
        float way = is_met ? found.t : far;
        density *= exp(-inside.extinction * way);
        if (!is_met) {
            density *= inside.extinction;
            kept *= inside.scattering;
        }
        density /= max(largest(density), 1.0e-30);
        vec3 weight = inside.weight * kept * density / max(dot(inside.shares, density), 1.0e-30);
        if (is_met) {
            Triangle met = triangle_at(found.triangle);
            vec3 ab = met.b - met.a, ac = met.c - met.a, normal = normal_of(ab, ac);
            if (dot(normal, direction) < 0.0) normal = -normal;
            return Exit(met.a + found.u * ab + found.v * ac, normal, weight);
        }
        if (!(largest(weight) > LEAST_OF_WALK * largest(inside.weight))) return none;
        position += way * direction;
        source = -1;
    }
    return none;
}

// Of several walks of a channel one by chance, as much as each brings: so passes differ less in what comes out. Channels
// take turns over passes.
Exit walk_below(vec3 entry, vec3 direction, vec3 weight, int triangle, vec3 walk, uint number) {
    Triangle entered = triangle_at(triangle);
    vec3 geometric = normal_of(entered.b - entered.a, entered.c - entered.a);
    if (dot(geometric, direction) > 0.0) geometric = -geometric;
    Exit chosen = Exit(entry, geometric, vec3(0.0));
    float sum = weight.r + weight.g + weight.b;
    if (!(sum > 0.0)) return chosen;
    vec3 radius = radius_of_walk(walk), albedo = albedo_of_walk(walk);
    vec3 scattering = albedo_of_scattering(albedo, is_later_walk(walk));
    uint dimension = DIMENSION_WALK + uint(depth) * uint(WALKS_A_RAY * MOST_FLIGHTS + 2);
    vec3 shares = mix(vec3(1.0 / 3.0), weight / sum, BY_WEIGHT);
    int channel = channel_by(shares, even_over_passes(dimension).x);
    vec3 stays = vec3(equal(radius, vec3(0.0)));  // light that leaves at once
    if (stays[channel] > 0.0) return Exit(entry, geometric, weight * stays / dot(shares, stays));
    vec3 goes = weight * (1.0 - stays) / albedo * min(scattering / LEAST_ALBEDO, 1.0);
    vec3 extinction = (1.0 - stays) / max(radius, vec3(LEAST_RADIUS));
    shares *= 1.0 - stays;
    scattering = max(scattering, vec3(LEAST_ALBEDO));
    Inside inside = Inside(entry, geometric, direction, triangle, extinction, scattering, goes, channel, shares);
    one_surface = entered.surface;
    float u = random4(seed, pass_index, number, dimension + 1u).x, all = 0.0, own = 0.0;
    for (int i = 0; i < WALKS_A_RAY; i++) {
        Exit found = walk_once(inside, i, number, dimension + uint(2 + i * MOST_FLIGHTS));
        float brings = mean(found.weight);
        if (!(brings > 0.0) || !is_drawn(brings, all, u)) continue;
        chosen = found;
        own = brings;
    }
    if (own > 0.0) chosen.weight *= all / (own * float(WALKS_A_RAY));
    return chosen;
}
