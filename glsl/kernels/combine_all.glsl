// SPDX-License-Identifier: GPL-3.0-or-later
// Combined = direct + indirect + mirror + background. Its alpha carries what the inner radius changes,
// so that the film keeps the variance of both.
void kernel() {
    vec3 radiance = load_direct_seen().radiance + load_indirect_seen().radiance
        + load_mirror_seen().radiance + load_mirror_indirect_seen().radiance
        + load_background_seen().radiance;
    store_combined(Radiance(radiance, load_blur_seen().difference));
}
