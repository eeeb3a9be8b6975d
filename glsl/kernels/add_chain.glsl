// SPDX-License-Identifier: GPL-3.0-or-later
// Add what a pixel's secondary ray sees to the images. Where rays have MOVED to smaller streams, the pixel
// knows which element is its own.
#ifdef MOVED
ivec2 source() {
    int number = int(load_element().number) - 1, width = textureSize(seen, 0).x;
    return ivec2(number % width, number / width);
}
#else
ivec2 source() { return element(); }
#endif

void kernel() {
    Radiance sum = load_sum(), indirect = load_indirect_sum();
#ifdef PHOTON_MAP
    Blur blur = load_blur_sum();
#endif
#ifdef TRANSPARENT
    Radiance background = load_background_sum();
#endif
#ifdef FEATURES
    Radiance albedo = load_albedo_sum(), normal = load_normal_sum();
#endif
#ifdef CAUSTICS
    Radiance caustics = load_caustics_sum();
#endif
    bool has_ended = false;
#ifdef MOVED
    has_ended = load_element().number == 0.0;
#endif
    if (!has_ended) {
        ivec2 at = source();
        Radiance more = unpack_Radiance(texelFetch(seen, at, 0));
        sum = Radiance(sum.radiance + more.radiance, sum.alpha + more.alpha);
        more = unpack_Radiance(texelFetch(indirect_seen, at, 0));
        indirect = Radiance(indirect.radiance + more.radiance, indirect.alpha + more.alpha);
#ifdef PHOTON_MAP
        Blur change = unpack_Blur(texelFetch(blur_seen, at, 0));
        blur = Blur(blur.inner + change.inner, blur.inner_share + change.inner_share, blur.difference + change.difference);
#endif
#ifdef CAUSTICS
        caustics.radiance += unpack_Radiance(texelFetch(caustics_seen, at, 0)).radiance;
#endif
#ifdef TRANSPARENT
        background.alpha -= unpack_Lost(texelFetch(lost, at, 0)).share;
#endif
#ifdef FEATURES
        if (normal.alpha == 0.0) {  // a mirror's so far
            albedo = unpack_Radiance(texelFetch(albedo_seen, at, 0));
            normal = unpack_Radiance(texelFetch(normal_seen, at, 0));
        }
#endif
    }
    store_total(sum);
    store_indirect_total(indirect);
#ifdef PHOTON_MAP
    store_blur_total(blur);
#endif
#ifdef TRANSPARENT
    store_background_total(background);
#endif
#ifdef FEATURES
    store_albedo_total(albedo);
    store_normal_total(normal);
#endif
#ifdef CAUSTICS
    store_caustics_total(caustics);
#endif
}
