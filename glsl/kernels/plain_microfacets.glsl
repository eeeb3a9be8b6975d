// SPDX-License-Identifier: GPL-3.0-or-later
// Say what the native core needs to gather photons with a point's lobes of microfacets.
#include "lib/place.glsl"
#include "lib/gathered.glsl"

Microfacets plain(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer) {
    Microfacets found = microfacets_kind(lobe, shape, normal, to_viewer);
    found.scale *= weight_of(shape);
    return found;
}

void kernel() {
    Place place = load_place();
    Lobe lobe0 = load_lobe0();
    Shape shape0 = load_shape0();
    shape0 = weighed(shape0, gathered_share(lobe0, shape0));
    bool is_some = has_weight(shape0);
#ifdef TWO_LOBES
    Lobe lobe1 = load_lobe1();
    Shape shape1 = load_shape1();
    shape1 = weighed(shape1, gathered_share(lobe1, shape1));
    is_some = is_some || has_weight(shape1);
#endif
    if (!is_place(place) || !is_some) skip();
    vec3 to_viewer = -load_direction().direction, shading = load_shading().normal;
    vec3 normal = raised_normal(shading, load_facing().normal, to_viewer);
    float cosine = max(0.0, dot(to_viewer, shading)), albedo = 0.0;
    if (has_weight(shape0)) albedo += mean(albedo_lobe(lobe0, shape0, cosine));
    Microfacets m = plain(lobe0, shape0, normal, to_viewer);
    store_scaled0(Scaled(m.scale, m.alpha));
    store_based0(Based(m.f0, m.ior));
    store_dipped0(Dipped(m.dip, m.shape));
#ifdef TWO_LOBES
    if (has_weight(shape1)) albedo += mean(albedo_lobe(lobe1, shape1, cosine));
    m = plain(lobe1, shape1, normal, to_viewer);
    store_scaled1(Scaled(m.scale, m.alpha));
    store_based1(Based(m.f0, m.ior));
    store_dipped1(Dipped(m.dip, m.shape));
#endif
    store_gathered(Gathered(normal, albedo));
}
