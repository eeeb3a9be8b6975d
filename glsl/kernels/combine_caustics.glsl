// SPDX-License-Identifier: GPL-3.0-or-later
// The part of indirect light that photons brought by way of lobes that are not diffuse, as a ray of any depth sees it.
#include "lib/hit.glsl"
#include "lib/constants.glsl"

void kernel() {
    vec3 radiance = vec3(0.0);
    if (is_hit(load_hit())) {
        radiance = load_diffuse().albedo / PI * load_caustic_irradiance().irradiance;
#ifdef GATHERED_LOBES
        radiance += load_caustic_gloss().radiance;
#endif
    }
    store_caustics_seen(Radiance(load_throughput().throughput * radiance, 0.0));
}
