// SPDX-License-Identifier: GPL-3.0-or-later
// Send each visible point's secondary ray: in a direction of one of its lobes.
#include "lib/even.glsl"
#include "lib/offset.glsl"
#include "lib/place.glsl"
#include "lib/lobe.glsl"
#include "lib/gathered.glsl"
#include "lib/chain_density.glsl"
#ifdef MEDIA
#include "lib/media.glsl"
#endif
#ifdef NORMALS
#include "lib/base_normal.glsl"
#include "lib/bump_shadowing.glsl"
#endif
#ifdef VISIBILITY
#include "lib/reach.glsl"

// Bits of the ray that a lobe sends.
int rays_of_lobe(Lobe lobe, bool is_through) {
#ifdef SCATTERING
    if (is_phase(lobe)) return RAY_DIFFUSE;
#endif
    int through = is_through ? RAY_TRANSMISSION : 0;
    return is_diffuse_kind(lobe.kind) ? RAY_DIFFUSE + through : is_through ? RAY_TRANSMISSION : RAY_GLOSSY;
}
#endif
#ifdef NO_CAUSTICS
#include "lib/no_caustics.glsl"
#endif

// Rays that carry less than this go on by Russian roulette, each by its own chance.
const float ROULETTE_BELOW = 0.05;
// Those of later bounces that carry less than this, and less than the surface shows of its own by Lambert's lobe, all do in
// the same passes: a GPU takes as long for a few rays' bounces as for many, and for none hardly any time. Others would
// make a whole picture lighter and darker together, such as one through two dark panes.
const float TOGETHER_BELOW = 0.1;

#ifdef TRANSPARENT
// The chain that goes straight on, or that a lobe scatters at a triangle.
Chain next_of(Chain chain, bool is_straight, float triangle) {
    if (!is_straight) return Chain(chain.bounces + 1.0, chain.passed, 0.0, triangle);
    return Chain(chain.bounces, chain.passed + 1.0, chain.distance + load_hit().t, chain.source);
}
#endif

void kernel() {
    Place place = load_place();
    Lobe lobe = load_lobe0();
    Shape shape = shape_of_rays(lobe, load_shape0());
    if (!is_place(place)) skip();
    Facing facing = load_facing();
    Shading shading = load_shading();
    vec3 to_viewer = -load_direction().direction;
    uint dimension = DIMENSION_SCATTER + uint(depth);
    uint number = uint(pixel_number(load_pixel().at));
    vec4 u = random4(seed, pass_index, number, dimension);
    u.xy = even_over_passes(dimension);
    float share = 1.0;
#ifdef TWO_LOBES
    Lobe other = load_lobe1();
    float cosine = max(0.0, dot(to_viewer, shading.normal));
    Shape other_shape = shape_of_rays(other, load_shape1());
    share = share_of_first(lobe, shape, other, other_shape, cosine);
    if (u.w >= share) {
        lobe = other;
        shape = other_shape;
        share = 1.0 - share;
    }
    shape = weighed(shape, 1.0 / share);
#endif
    if (!is_lobe(lobe)) skip();
#ifdef MEDIA
    Medium medium = load_medium();
#endif
#ifdef SCATTERING
    bool is_of_medium = is_in_medium(place);
    if (is_of_medium && ++medium.scattered > float(volume_bounces)) skip();
#endif
#ifdef TRANSPARENT
    Chain chain = load_chain();
    bool is_straight = is_transparent(lobe);
    if (is_straight ? chain.passed >= float(transparent_depth) : chain.bounces >= float(chain_depth)) skip();
#endif
    vec3 weight, normal = normal_of_lobe(lobe, shape, shading.normal, facing.normal, to_viewer);
    vec3 outgoing = sample_lobe(lobe, shape, normal, to_viewer, u.xy, weight);
#ifdef NORMALS
    if (is_softened_kind(lobe.kind) && !transmits_kind(lobe.kind)) {
        vec3 base = base_normal(place, facing, shading, load_diffuse());
        weight *= bump_shadowing(base, shading.normal, outgoing);
    }
#endif
    vec3 before = load_throughput().throughput, throughput = before * weight;
    float carried = largest(throughput);
    bool goes_together = depth > 0 && carried < min(TOGETHER_BELOW, largest(before * load_diffuse().albedo));
    float survival = min(1.0, carried / (goes_together ? TOGETHER_BELOW : ROULETTE_BELOW));
    if (goes_together) u.z = even_over_passes(ALL_PIXELS, dimension).x;
    float t_max = T_MAX, density = 0.0;
    bool leads_on = is_onward(outgoing, facing.normal, normal);
#ifdef TRANSPARENT
    leads_on = leads_on || is_straight;
#endif
    if (!leads_on || !(u.z < survival)) skip();
#ifdef NO_CAUSTICS
    if (is_by_diffuse(load_direction().t_max) && lacks(lobe.kind, caustic_by(outgoing, facing.normal))) skip();
#endif
#ifdef VISIBILITY
    t_max = reach_of(1 + rays_of_lobe(lobe, dot(outgoing, facing.normal) < 0.0));
#endif
#ifdef WEIGHED
    density = share * pdf_lobe(lobe, shape, normal, to_viewer, outgoing);
#endif
#ifdef SCATTERING
    if (is_of_medium) density = ALL_BY_SHADOW_RAYS;
#endif
    throughput /= survival;
    vec3 from = offset_origin(place.position, facing.normal, outgoing);
    bool goes_behind = dot(outgoing, facing.normal) < 0.0;
#ifdef WALKS
    bool goes_below = lobe.kind == float(SUBSURFACE);
    if (goes_below) from = place.position;
    goes_behind = goes_behind && !goes_below;
    store_walk(Walk(goes_below ? shape.parameters : vec3(0.0), float(goes_below)));
#endif
#ifdef TRANSPARENT
    if (is_straight) {
        // The same ray as before, of the eye up to its clip distance, or of a lobe with the density of that.
        t_max = load_direction().t_max;
        if (chain.bounces == 0.0) t_max -= load_hit().t;
        else density = density_of(load_throughput());
    }
    chain = next_of(chain, is_straight, shading.triangle);
    store_next_chain(chain);
#endif
#ifdef DISPERSION
    if (has_colour(load_throughput()) || disperses_kind(lobe.kind)) density = density_with_colour(density);
#endif
#ifdef MEDIA
#ifdef SCATTERING
    goes_behind = goes_behind && !is_of_medium;
#endif
    if (goes_behind) medium = medium_behind(medium, load_hit(), facing.side);
    store_next_medium(medium);
#endif
    store_next_origin(RayOrigin(from, shading.triangle));
    store_next_direction(RayDirection(outgoing, t_max));
    store_next_throughput(Throughput(throughput, density));
}
