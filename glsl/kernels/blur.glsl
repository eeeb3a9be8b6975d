// SPDX-License-Identifier: GPL-3.0-or-later
// Add what the bias is estimated from: the indirect light within the radius against that within the
// inner one, means of the channels. The picture divides means by mean coverages, as for the light itself.
#include "lib/constants.glsl"
#include "lib/colour.glsl"

void kernel() {
    Blur sum = load_sum();
    Irradiance irradiance = load_irradiance();
    float weight = mean(load_throughput().throughput * load_diffuse().albedo);
    float inner = weight / PI * irradiance.inner, outer = weight / PI * mean(irradiance.irradiance);
#ifdef GATHERED_LOBES
    float share = mean(load_throughput().throughput);
    Gloss gloss = load_gloss();
    weight += share * load_gathered().albedo;
    inner += share * gloss.inner;
    outer += share * mean(gloss.radiance);
#endif
    store_total(Blur(sum.inner + inner, sum.inner_share + weight * load_coverage().inner, sum.difference + outer - inner));
}
