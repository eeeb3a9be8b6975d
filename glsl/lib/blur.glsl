// SPDX-License-Identifier: GPL-3.0-or-later
// What the bias is estimated from: the indirect light within the radius against that within the inner one,
// means of the channels. The picture divides means by mean coverages, as for the light itself.
#include "lib/constants.glsl"
#include "lib/colour.glsl"

Blur blur_of(vec3 throughput) {
    Irradiance irradiance = load_irradiance();
    float weight = mean(throughput * load_diffuse().albedo);
    float inner = weight / PI * irradiance.inner, outer = weight / PI * mean(irradiance.irradiance);
#ifdef GATHERED_LOBES
    float share = mean(throughput);
    Gloss gloss = load_gloss();
    weight += share * load_gathered().albedo;
    inner += share * gloss.inner;
    outer += share * mean(gloss.radiance);
#endif
    return Blur(inner, weight * load_coverage().inner, outer - inner);
}
