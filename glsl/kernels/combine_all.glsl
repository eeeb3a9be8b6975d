// SPDX-License-Identifier: GPL-3.0-or-later
// Combined = direct + indirect + mirror + background.
void kernel() {
    Radiance background = load_background_seen();
    vec3 radiance = load_direct_seen().radiance + load_indirect_seen().radiance
        + load_mirror_seen().radiance + load_mirror_indirect_seen().radiance + background.radiance;
    store_combined(Radiance(radiance, background.alpha));
}
