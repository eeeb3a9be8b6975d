// SPDX-License-Identifier: GPL-3.0-or-later
// Add what a pixel's secondary ray sees to the images.
void kernel() {
    Radiance sum = load_sum(), indirect = load_indirect_sum();
#ifdef PHOTON_MAP
    Blur blur = load_blur_sum();
#endif
#ifdef TRANSPARENT
    Radiance background = load_background_sum();
#ifdef MIST
    Radiance mist = load_mist_sum();
#endif
#endif
#ifdef FEATURES
    Radiance albedo = load_albedo_sum(), normal = load_normal_sum();
#endif
#ifdef CAUSTICS
    Radiance caustics = load_caustics_sum();
#endif
    Radiance more = load_seen();
    sum = Radiance(sum.radiance + more.radiance, sum.alpha + more.alpha);
    more = load_indirect_seen();
    indirect = Radiance(indirect.radiance + more.radiance, indirect.alpha + more.alpha);
#ifdef PHOTON_MAP
    Blur change = load_blur_seen();
    blur = Blur(blur.inner + change.inner, blur.inner_share + change.inner_share, blur.difference + change.difference);
#endif
#ifdef CAUSTICS
    caustics.radiance += load_caustics_seen().radiance;
#endif
#ifdef TRANSPARENT
    background.alpha -= load_lost().share;
#ifdef MIST
    mist.alpha += load_mist_seen().alpha;
#endif
#endif
#ifdef FEATURES
    if (normal.alpha == 0.0) {  // a mirror's so far
        albedo = load_albedo_seen();
        normal = load_normal_seen();
    }
#endif
    store_total(sum);
    store_indirect_total(indirect);
#ifdef PHOTON_MAP
    store_blur_total(blur);
#endif
#ifdef TRANSPARENT
    store_background_total(background);
#ifdef MIST
    store_mist_total(mist);
#endif
#endif
#ifdef FEATURES
    store_albedo_total(albedo);
    store_normal_total(normal);
#endif
#ifdef CAUSTICS
    store_caustics_total(caustics);
#endif
}
