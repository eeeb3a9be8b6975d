// SPDX-License-Identifier: GPL-3.0-or-later
// What a chain's secondary ray sees, indirect light apart. Their alphas are the chain's weight without and with
// the coverage, which correct the indirect part's boundaries.
#include "lib/hit.glsl"
#include "lib/constants.glsl"
#include "lib/colour.glsl"
#ifdef TRANSPARENT
#include "lib/diffuse.glsl"
#endif
#ifdef PHOTON_MAP
#include "lib/blur.glsl"
#endif
#include "lib/clamped.glsl"
#if defined(MIST) && defined(TRANSPARENT)
#include "lib/mist.glsl"
#endif
#ifdef WALKS
#include "lib/reach.glsl"
#endif

// Of the chain, where that is asked.
int bounces() {
    int found = 0;
#if defined(CLAMPED) && defined(TRANSPARENT)
    found = int(load_chain().bounces);
#elif defined(CLAMPED)
    found = depth;
#endif
#if defined(CLAMPED) && defined(WALKS)
    found -= int(is_exit(load_direction().t_max));  // as in Cycles, a walk is no bounce
#endif
    return found;
}

void kernel() {
    vec3 throughput = load_throughput().throughput;
#ifdef MEDIA
    vec3 arriving = load_arriving().throughput;  // before its way, of which lights know
#else
    vec3 arriving = throughput;
#endif
    vec3 seen = vec3(0.0), direct = vec3(0.0), indirect = vec3(0.0);
#ifdef EMITTERS
    vec3 world = load_environment().radiance;
#ifdef TRANSPARENT
    if (load_chain().bounces == 0.0) world *= background_alpha;
#endif
    seen = load_emitted().radiance + world;
#endif
#ifdef TRANSPARENT
    // What the eye sees through transparent surfaces is as opaque as what is there.
    bool is_held_out = is_hit(load_hit()) && is_holdout(load_diffuse());
    if (is_held_out) seen = vec3(0.0);
    float lost = is_held_out ? 1.0 - let_through_by(load_diffuse()) : (is_hit(load_hit()) ? 0.0 : 1.0 - background_alpha);
#ifdef MIST
    // And as near, instead of where the ray begins, of which that was told.
    bool tells = is_hit(load_hit()) && !is_scattered(load_hit()) && lost < 1.0;
    float near = tells ? mean(throughput) * nearness_of(load_place().position) : 0.0;
    near -= mean(arriving) * nearness_of(load_origin().position);
    store_mist_seen(Radiance(vec3(0.0), load_chain().bounces == 0.0 ? near : 0.0));
#endif
    store_lost(Lost(load_chain().bounces == 0.0 ? mean(throughput) * lost : 0.0));
#endif
    float weight = 0.0, coverage = load_coverage().share;
    if (is_hit(load_hit())) {
        vec3 diffuse = load_diffuse().albedo;
        weight = mean(throughput * diffuse);
        direct = load_direct().radiance;
        indirect = diffuse / PI * load_irradiance().irradiance;
#ifdef GATHERED_LOBES
        weight += mean(throughput) * load_gathered().albedo;
        indirect += load_gloss().radiance;
#endif
    }
    // Lights that rays meet are direct light of where those were sent.
    vec3 met = limited(arriving * seen, bounces() < 2), found = limited(throughput * direct, bounces() < 1);
    store_seen(Radiance(met + found, weight));
    store_indirect_seen(Radiance(throughput * indirect, weight * coverage));
#ifdef PHOTON_MAP
    store_blur_seen(blur_of(throughput));
#endif
}
