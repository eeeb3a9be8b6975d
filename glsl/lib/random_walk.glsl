// SPDX-License-Identifier: GPL-3.0-or-later
// The walk below a surface of light that goes the other way, from where it comes out to where it went in: free flights,
// all directions alike where they end, until one meets the surface again. Chiang, Kutz & Burley 2016, "Practical and
// Controllable Subsurface Scattering for Production Path Tracing", with Cycles' fit of the albedo of one scattering.
#include "lib/bvh.glsl"
#include "lib/triangle.glsl"
#include "lib/lobe.glsl"

const int MOST_FLIGHTS = 256;
const float LEAST_OF_WALK = 1.0e-4;  // of a path that has less nothing is left
const int WALKS_A_RAY = 4;
const float LEAST_ALBEDO = 0.2;  // of one scattering; less is taken off the weight

// Where the walk has left the surface, and what it weighs; triangle -1: nowhere.
struct Exit { vec3 position; vec3 normal; vec3 weight; int triangle; };

// What one scattering leaves, for surfaces of such an albedo.
vec3 albedo_of_scattering(vec3 albedo) {
    vec3 few = 0.496310210422 * pow(atan(4.23500904 * albedo), vec3(2.40602999408));
    vec3 many = 1.8260523782 * pow(atan(5.1124679 * albedo), vec3(1.09686102424));
    return clamp(mix(many, few, pow(albedo, vec3(0.25))), 0.0, 0.999999);
}

vec3 unit_sphere(vec2 u) {
    float z = 1.0 - 2.0 * u.x, radius = sqrt(max(0.0, 1.0 - z * z));
    return vec3(radius * cos(2.0 * PI * u.y), radius * sin(2.0 * PI * u.y), z);
}

// A way below the surface, by the lobe's numbers for each channel.
struct Inside {
    vec3 entry;
    vec3 geometric;
    vec3 direction;
    int triangle;
    float surface;
    vec3 radius;
    vec3 albedo;
    vec3 scattering;
};

// One walk of several; `weight`: of the ray, which has the lobe's colour.
Exit walk_once(Inside inside, vec3 weight, uint number, uint dimension) {
    vec3 extinction = 1.0 / max(inside.radius, vec3(1.0e-10)), position = inside.entry, direction = inside.direction;
    // Channels whose light leaves at once, or the others.
    vec4 u = random4(seed, pass_index, number, dimension);
    vec3 at_once = mix(vec3(0.0), weight, equal(inside.radius, vec3(0.0)));
    float share = mean(at_once) / max(mean(weight), 1.0e-30);
    if (u.x < share) return Exit(inside.entry, inside.geometric, at_once / share, inside.triangle);
    weight = (weight - at_once) / max(inside.albedo, vec3(1.0e-6)) / (1.0 - share);
    weight *= min(inside.scattering / LEAST_ALBEDO, 1.0);
    vec3 scattering = max(inside.scattering, vec3(LEAST_ALBEDO)), shares = vec3(0.0);
    position -= inside.geometric * (SURFACE_OFFSET * max(1.0, largest(abs(position))));
    float brightest = largest(weight), left = -1.0, gone = 0.0;
    int source = inside.triangle, flight = 0;
    for (int look = 0; look < 2 * MOST_FLIGHTS && flight < MOST_FLIGHTS; look++) {
        if (left < 0.0) {
            u = random4(seed, pass_index, number, dimension + 1u + uint(flight));
            if (flight > 0) direction = unit_sphere(u.zw);
            shares = weight * scattering;
            shares /= shares.r + shares.g + shares.b;
            int channel = u.x < shares.r ? 0 : (u.x < shares.r + shares.g ? 1 : 2);
            left = -log(1.0 - u.y) / extinction[channel];
            gone = 0.0;
            flight++;
        }
        RayHit found = trace(position, direction, left, source);
        bool is_met = found.triangle >= 0;
        float way = is_met ? found.t : left;
        position += way * direction;
        gone += way;
        source = found.triangle;
        vec3 through = exp(-extinction * gone);
        if (is_met) {
            Triangle met = triangle_at(found.triangle);
            if (met.surface != inside.surface) {  // of another thing, which is not in the way
                left -= way;
                continue;
            }
            vec3 ab = met.b - met.a, ac = met.c - met.a, normal = normal_of(ab, ac);
            if (dot(normal, direction) < 0.0) normal = -normal;
            position = met.a + found.u * ab + found.v * ac;
            return Exit(position, normal, weight * through / max(dot(shares, through), 1.0e-30), found.triangle);
        }
        vec3 density = extinction * through;
        weight *= scattering * density / max(dot(shares, density), 1.0e-30);
        if (!(largest(weight) > LEAST_OF_WALK * brightest)) break;
        left = -1.0;
    }
    return Exit(inside.entry, inside.geometric, vec3(0.0), -1);
}

// Of several walks one by chance, as much as each brings: so passes differ less in what comes out.
Exit walk_below(vec3 entry, vec3 geometric, vec3 direction, vec3 weight, int triangle, Shape shape, uint number) {
    vec3 radius = radius_subsurface(shape), albedo = albedo_subsurface(shape), scattering = albedo_of_scattering(albedo);
    float surface = triangle_at(triangle).surface;
    Inside inside = Inside(entry, geometric, direction, triangle, surface, radius, albedo, scattering);
    uint dimension = DIMENSION_WALK + uint(depth) * uint(WALKS_A_RAY * 2 * MOST_FLIGHTS);
    float u = random4(seed, pass_index, number, dimension + uint(2 * MOST_FLIGHTS - 1)).x, all = 0.0, own = 0.0;
    Exit chosen = Exit(entry, geometric, vec3(0.0), -1);
    for (int i = 0; i < WALKS_A_RAY; i++) {
        Exit found = walk_once(inside, weight, number, dimension + uint(i * 2 * MOST_FLIGHTS));
        float brings = mean(found.weight), others = all;
        if (!(brings > 0.0)) continue;
        all += brings;
        float at = u * all;
        bool is_taken = at < brings || others == 0.0;
        u = min(is_taken ? at / brings : (at - brings) / others, BELOW_ONE);
        if (!is_taken) continue;
        chosen = found;
        own = brings;
    }
    if (own > 0.0) chosen.weight *= all / (own * float(WALKS_A_RAY));
    return chosen;
}
