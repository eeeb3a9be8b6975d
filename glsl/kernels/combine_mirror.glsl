// SPDX-License-Identifier: GPL-3.0-or-later
// Add what a chain's secondary ray sees to the mirror image, indirect light apart. Their alphas sum
// up the chain's weight without and with the coverage, which correct the indirect part's boundaries.
#include "lib/hit.glsl"
#include "lib/constants.glsl"
#include "lib/colour.glsl"

void kernel() {
    Radiance sum = load_sum();
    Radiance indirect_sum = load_indirect_sum();
    vec3 throughput = load_throughput().throughput;
    vec3 seen = vec3(0.0), indirect = vec3(0.0);
#ifdef EMITTERS
    seen = load_emitted().radiance + load_environment().radiance;
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
