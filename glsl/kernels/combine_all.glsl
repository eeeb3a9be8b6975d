// SPDX-License-Identifier: GPL-3.0-or-later
// Combined = direct + indirect + mirror + emission + background. Its alpha carries what the inner radius changes,
// so that the film keeps the variance of both.
void kernel() {
    vec3 radiance = load_direct_seen().radiance + load_indirect_seen().radiance
        + load_mirror_seen().radiance + load_mirror_indirect_seen().radiance
        + load_background_seen().radiance;
#ifdef EMITTERS
    radiance += load_emission_seen().radiance;
#endif
    store_combined(Radiance(radiance, load_blur_seen().difference));
}
