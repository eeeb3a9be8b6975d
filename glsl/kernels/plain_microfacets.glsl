// SPDX-License-Identifier: GPL-3.0-or-later
// Say what the native core needs to gather photons with a point's lobes of microfacets.
#include "lib/place.glsl"
#include "lib/gatherer.glsl"

Microfacets plain(Gatherer g, Lobe lobe, Shape shape) {
    Microfacets found = microfacets_kind(lobe, shape, g.normal, g.to_viewer);
    found.scale *= weight_of(shape);
    return found;
}

void kernel() {
    Gatherer g = gatherer_of(load_facing().normal);
    if (!is_place(load_place()) || !(has_weight(g.shape0) || has_weight(g.shape1)) || has_other_lobes(g)) skip();
    Microfacets m = plain(g, g.lobe0, g.shape0);
    store_scaled0(Scaled(m.scale, m.alpha));
    store_based0(Based(m.f0, m.ior));
    store_dipped0(Dipped(m.dip, m.shape));
#ifdef TWO_LOBES
    m = plain(g, g.lobe1, g.shape1);
    store_scaled1(Scaled(m.scale, m.alpha));
    store_based1(Based(m.f0, m.ior));
    store_dipped1(Dipped(m.dip, m.shape));
#endif
    store_gathered(Gathered(g.normal, g.albedo));
}
