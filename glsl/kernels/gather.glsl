// SPDX-License-Identifier: GPL-3.0-or-later
// Add to each visible point's sum the photons around it, of a range of a grid of sorted photons.
#include "lib/density.glsl"
#include "lib/cuts.glsl"
#include "lib/radius.glsl"
#include "lib/place.glsl"
#include "lib/of_part.glsl"
#ifdef NORMALS
#include "lib/bent.glsl"
#endif
#ifdef GATHERED_LOBES
#include "lib/gatherer.glsl"

// By how much light from the grazing side of a smooth normal is brighter than the flux that fell, at most; of diffuse
// lobes BRIGHTEST, as Lambert's.
const float MOST_BRIGHTER = 4.0;

// What a lobe sends on to the viewer of a photon's flux [1/sr]. The flux fell on the geometric normal, and
// lobes are about the shading normal: the quotient of cosines is what a ray of theirs would weigh.
vec3 gathered_by(Lobe lobe, Shape shape, Gatherer g, vec3 geometric, vec3 to_light) {
    vec3 normal = is_about_shading_kind(lobe.kind) ? g.shading : g.normal;
    float cosine = dot(to_light, normal), fell = dot(to_light, geometric);
    if (!has_weight(shape) || cosine <= 0.0 || fell <= 0.0) return vec3(0.0);
    float brighter = min(cosine / fell, is_diffuse_kind(lobe.kind) ? BRIGHTEST : MOST_BRIGHTER);
#ifdef NORMALS
    if (is_softened_kind(lobe.kind)) brighter *= bump_shadowing(bent_of(geometric).base, normal, to_light);
#endif
    return brighter * eval_lobe(lobe, shape, normal, g.to_viewer, to_light);
}

vec3 gathered_bsdf(Gatherer g, vec3 geometric, vec3 to_light) {
    vec3 value = gathered_by(g.lobe0, g.shape0, g, geometric, to_light);
    return value + gathered_by(g.lobe1, g.shape1, g, geometric, to_light);
}
#endif

// Sums over photons within the radius, or the shares of them that this lane adds up.
struct Sums { vec4 irradiance; vec4 gloss; };
#ifndef GATHERED_LOBES
struct Gatherer { float albedo; };
#endif

Sums sums_about(Place place, vec3 normal, float radius, Cuts cuts, Coverage coverage, Gatherer gatherer) {
    float inverse_r2 = 1.0 / (radius * radius);
    // The margin covers the rounding of photons to cells.
    vec3 reach = vec3(radius * 1.00001 + 1.0e-7);
    ivec3 low = ivec3(floor((place.position - reach - grid_origin) / cell_size));
    ivec3 high = ivec3(floor((place.position + reach - grid_origin) / cell_size));
    low = max(low, ivec3(0));
    high = min(high, grid_cells - 1);
    vec3 first = cut_in_space(cuts.first, normal), second = cut_in_space(cuts.second, normal);
    bool is_cut = cuts.first != vec2(0.0);
    Tilt tilt = load_tilt();
    vec3 outer = tilt_in_space(tilt.outer, normal), inner = tilt_in_space(tilt.inner, normal);
    Sums sums = Sums(vec4(0.0), vec4(0.0));
    float surface = of_part(place.surface, part);  // as those photons have it that are of the point's own pass
#ifdef NORMALS
    Bent bent = bent_of(normal);
    bool is_bent = bent.normal != normal;
#endif
    for (int z = low.z; z <= high.z; z++) {
        for (int y = low.y; y <= high.y; y++) {
            int row = first_cell + (z * grid_cells.y + y) * grid_cells.x;
            if (low.x > high.x) continue;
            int end = min(int(cell_start(row + high.x + 1)), photon_range.y);
            int i = max(int(cell_start(row + low.x)), photon_range.x) + lane();
            // Each is read while the one before is looked at, and what it brings only where it may count: a GPU
            // waits for what it reads.
            vec4 next = i < end ? photon_place(i) : vec4(0.0);
            for (; i < end; i += LANES) {
                vec4 photon = next;
                next = photon_place(min(i + LANES, end - 1));
                vec3 offset = photon.xyz - place.position;
                if (!is_about(photon, offset, surface, normal, inverse_r2)) continue;
                if (dot(offset, first) > 1.0 || dot(offset, second) > 1.0) continue;
                float x2 = dot(offset, offset) * inverse_r2;
                vec4 deposit = photon_deposit(i), share = photon_share(deposit, x2, normal);
                float inner_tilt = 1.0;
                if (is_cut) {
                    inner_tilt += dot(offset, inner);
                    share *= vec4(vec3(1.0 + dot(offset, outer)), inner_tilt);
                }
#ifdef NORMALS
                vec4 kept = share;
                if (is_bent) kept *= bent_share(bent.base, bent.normal, normal, direction_with_flux(deposit.rgb));
                sums.irradiance += kept;
#else
                sums.irradiance += share;
#endif
#ifdef GATHERED_LOBES
                if (gatherer.albedo == 0.0 || share == vec4(0.0)) continue;
                vec3 value = gathered_bsdf(gatherer, normal, direction_with_flux(deposit.rgb));
                float inner_share = inner_filter_shape(x2) * inner_tilt;
                sums.gloss += vec4(value * share.rgb, mean(value * deposit.rgb) * inner_share);
#endif
            }
        }
    }
    vec4 scale = filter_peak(radius * radius) * vec4(vec3(coverage.scale), coverage.inner_scale);
    return Sums(sums.irradiance * scale, sums.gloss * scale);
}

void kernel() {
    Place place = load_place();
    Coverage coverage = load_coverage();
    // On glass, say, no photon lands, and those of what is behind it may be many.
    bool is_gathering = is_place(place) && coverage.scale > 0.0;
    if (!LANES_WAIT && !is_gathering) skip();
    vec3 normal = load_facing().normal;
    Cuts cuts = load_cuts();
    float radius = cut_radius(radius_at(place.position, normal), cuts.first);
    Sums sums = Sums(vec4(0.0), vec4(0.0));
#ifdef GATHERED_LOBES
    Gatherer gatherer = gatherer_of(normal);
#ifdef OTHER_LOBES
    if (!is_place(place) || !has_other_lobes(gatherer)) skip();
#endif
#else
    Gatherer gatherer = Gatherer(0.0);
#endif
    if (is_gathering && radius > 0.0) sums = sums_about(place, normal, radius, cuts, coverage, gatherer);
    vec4 irradiance = sum_over_lanes(sums.irradiance);
    Irradiance sum = load_sum();
    store_irradiance(Irradiance(sum.irradiance + irradiance.rgb, sum.inner + irradiance.a));
#ifdef GATHERED_LOBES
    vec4 gloss = sum_over_lanes(sums.gloss);
    Gloss gloss_sum = load_gloss_sum();
    store_gathered(Gathered(gatherer.normal, is_place(place) ? gatherer.albedo : 0.0));
    store_gloss(Gloss(gloss_sum.radiance + gloss.rgb, gloss_sum.inner + gloss.a));
#endif
}
