// SPDX-License-Identifier: GPL-3.0-or-later
// Add what a chain's secondary ray sees to the mirror image, indirect light apart. Their alphas sum
// up the chain's weight without and with the coverage, which correct the indirect part's boundaries.
#include "lib/hit.glsl"
#include "lib/constants.glsl"
#include "lib/colour.glsl"
#ifdef TRANSPARENT
#include "lib/diffuse.glsl"
#endif

void kernel() {
    Radiance sum = load_sum();
    Radiance indirect_sum = load_indirect_sum();
    vec3 throughput = load_throughput().throughput;
    vec3 seen = vec3(0.0), indirect = vec3(0.0);
#ifdef EMITTERS
    vec3 world = load_environment().radiance;
#ifdef TRANSPARENT
    if (load_chain().bounces == 0.0) world *= background_alpha;
#endif
    seen = load_emitted().radiance + world;
#endif
#ifdef TRANSPARENT
    // What the eye sees through transparent surfaces is as opaque as what is there.
    Radiance background = load_background_sum();
    bool is_held_out = is_hit(load_hit()) && is_holdout(load_diffuse());
    if (is_held_out) seen = vec3(0.0);
    float lost = is_held_out ? 1.0 : (is_hit(load_hit()) ? 0.0 : 1.0 - background_alpha);
    if (load_chain().bounces == 0.0) background.alpha -= mean(throughput) * lost;
    store_background_total(background);
#endif
    float weight = 0.0, coverage = load_coverage().share;
    if (is_hit(load_hit())) {
        vec3 diffuse = load_diffuse().albedo;
        weight = mean(throughput * diffuse);
        seen += load_direct().radiance;
        indirect = diffuse / PI * load_irradiance().irradiance;
#ifdef GATHERED_LOBES
        weight += mean(throughput) * load_gathered().albedo;
        indirect += load_gloss().radiance;
#endif
    }
    store_total(Radiance(sum.radiance + throughput * seen, sum.alpha + weight));
    store_indirect_total(
        Radiance(indirect_sum.radiance + throughput * indirect, indirect_sum.alpha + weight * coverage));
}
