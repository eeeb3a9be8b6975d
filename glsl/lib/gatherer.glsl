// SPDX-License-Identifier: GPL-3.0-or-later
// The lobes of a point that gather photons, as its streams have them.
#include "lib/gathered.glsl"

// `normal`: of lobes that are not about the shading normal.
struct Gatherer {
    float albedo;
    Lobe lobe0; Shape shape0; Lobe lobe1; Shape shape1;
    vec3 shading; vec3 normal; vec3 to_viewer;
};

Gatherer gatherer_of(vec3 geometric) {
    Gatherer g;
    g.lobe0 = load_lobe0();
    g.shape0 = load_shape0();
    g.lobe1 = Lobe(vec3(0.0), 0.0);
    g.shape1 = Shape(vec3(0.0), 0.0);
#ifdef TWO_LOBES
    g.lobe1 = load_lobe1();
    g.shape1 = load_shape1();
#endif
    g.shape0 = weighed(g.shape0, gathered_share(g.lobe0, g.shape0));
    g.shape1 = weighed(g.shape1, gathered_share(g.lobe1, g.shape1));
    g.to_viewer = -load_direction().direction;
    vec3 shading = g.shading = load_shading().normal;
    g.normal = normal_of_lobes(g.lobe0, g.lobe1, shading, geometric, g.to_viewer);
    float cosine = max(0.0, dot(g.to_viewer, shading));
    g.albedo = 0.0;
    if (has_weight(g.shape0)) g.albedo += mean(albedo_lobe(g.lobe0, g.shape0, cosine));
    if (has_weight(g.shape1)) g.albedo += mean(albedo_lobe(g.lobe1, g.shape1, cosine));
    return g;
}

bool is_other(Gatherer g, Lobe lobe, Shape shape) {
    return has_weight(shape) && !is_microfacets(microfacets_kind(lobe, shape, g.normal, g.to_viewer));
}

// Whether a lobe gathers that is not of microfacets, so that the native core does not know it.
bool has_other_lobes(Gatherer g) { return is_other(g, g.lobe0, g.shape0) || is_other(g, g.lobe1, g.shape1); }
