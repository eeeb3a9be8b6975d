// SPDX-License-Identifier: GPL-3.0-or-later
// A visible point, and what its lobes reflect of a light that shadow rays find: which rays find it for which lobe, and the
// part of each where several do.
#include "lib/asked_lights.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#ifdef LOBES
#include "lib/gathered.glsl"
#endif
#ifdef NORMALS
#include "lib/base_normal.glsl"
#include "lib/bump_shadowing.glsl"
#endif

struct VisiblePoint {
    Place place;
    Facing facing;
    Shading shading;
    Diffuse diffuse;
    vec3 to_viewer;
    vec3 base;  // normal of the smooth surface, about which the shading normal may be bent
    float bounces;  // of lobes, that the ray to it has behind it
    float passed;   // transparent surfaces that it has passed: a shadow ray has what is left
#ifdef LOBES
    vec3 raised;  // normal of the lobes
    Lobe lobe0;
    Shape shape0;
#ifdef TWO_LOBES
    Lobe lobe1;
    Shape shape1;
#endif
#endif
};

#ifdef WEIGHED
// Of a lobe, of which rays that find the light as well have a part; `own` 0: all of it.
float part_of_shadow_rays(float own, float density, Lobe lobe, Shape shape) {
    float by_rays = 1.0;
#ifdef GATHERED_LOBES
    by_rays -= gathered_share(lobe, shape);
#endif
    return 1.0 - by_rays + (own > 0.0 ? by_rays * (own / (own + density)) : 0.0);
}
#endif

// The cosine to a light of Lambert's lobe, or what stands for it.
float cosine_of_diffuse(VisiblePoint point, vec3 to_light) {
    float cosine = max(0.0, dot(to_light, point.shading.normal));
#ifdef NORMALS
    cosine *= bump_shadowing(point.base, point.shading.normal, to_light);
#endif
    return cosine;
}

#ifdef LOBES
// Whether the light comes from behind, seen from the viewer.
bool is_behind(VisiblePoint point) {
#ifdef SCATTERING
    if (is_phase(point.lobe0)) return false;  // it has no sides
#endif
#ifdef TWO_SIDED
    return dot(point.to_viewer, point.facing.normal) < 0.0;
#else
    return false;
#endif
}

vec3 normal_of(VisiblePoint point, Lobe lobe, Shape shape) {
    return normal_of_lobe(lobe, shape, point.shading.normal, point.raised, point.facing.normal, point.to_viewer);
}

// The cosine of one of the other lobes, or what stands for it.
float cosine_of(VisiblePoint point, Lobe lobe, Shape shape, vec3 to_light) {
    vec3 normal = normal_of(point, lobe, shape);
#ifdef SCATTERING
    if (is_phase(lobe)) return abs(dot(to_light, normal));
#endif
    float cosine = dot(to_light, normal);
#ifdef NORMALS
    if (is_softened_kind(lobe.kind)) cosine *= bump_shadowing(point.base, normal, to_light);
    else if (leaks(point.base, normal, to_light)) return 0.0;
#endif
    return max(0.0, is_behind(point) ? -cosine : cosine);
}

float most_cosine_of_lobes(VisiblePoint point, vec3 to_light) {
    float most = cosine_of(point, point.lobe0, point.shape0, to_light);
#ifdef TWO_LOBES
    most = max(most, cosine_of(point, point.lobe1, point.shape1, to_light));
#endif
    return most;
}

#ifdef SHADOW_RAYS_BY_LOBES
// What gathers photons sends no rays, and by the cosine few shadow rays to the world would go where it reflects most. So
// a second one goes where such a lobe sends it. Each ray of the two has its part by the balance heuristic.

// With which probability that is the point's first lobe; below 0: it has none that gathers.
float share_of_first_to_gather(VisiblePoint point) {
    float first = gathered_share(point.lobe0, point.shape0), second = 0.0;
#ifdef TWO_LOBES
    second = gathered_share(point.lobe1, point.shape1);
#endif
    return first + second > 0.0 ? first / (first + second) : -1.0;
}

float pdf_to_gather(VisiblePoint point, float first, vec3 to_light) {
    vec3 normal = normal_of(point, point.lobe0, point.shape0);
    float density = first * pdf_lobe(point.lobe0, point.shape0, normal, point.to_viewer, to_light);
#ifdef TWO_LOBES
    normal = normal_of(point, point.lobe1, point.shape1);
    if (first < 1.0) density += (1.0 - first) * pdf_lobe(point.lobe1, point.shape1, normal, point.to_viewer, to_light);
#endif
    return density;
}

// A direction alone: its share is 0 if there is none.
LightSample sample_to_gather(VisiblePoint point, float first, vec2 u) {
    LightSample found = LightSample(point.raised, T_MAX, vec3(0.0), 0.0);
    Lobe lobe = point.lobe0;
    Shape shape = point.shape0;
#ifdef TWO_LOBES
    if (u.x >= first) {
        lobe = point.lobe1;
        shape = point.shape1;
        u.x = (u.x - first) / (1.0 - first);
    } else {
        u.x /= first;
    }
#endif
    vec3 weight;
    found.to_light = sample_lobe(lobe, shape, normal_of(point, lobe, shape), point.to_viewer, u, weight);
    if (largest(weight) > 0.0) found.share = 1.0;
    return found;
}
#endif

#ifdef PANES
vec3 not_of_rays;  // of what eval_lobes gave last, which no ray of a lobe finds
#endif

// Whether shadow rays find a light for a lobe. Those of diffuse lobes are diffuse rays, but where rays of lobes alone find
// the light they do, whatever their lobe is.
bool is_found_for(Light light, Lobe lobe) {
#ifdef SCATTERING
    if (is_phase(lobe)) return is_found(light, BY_MEDIA);
#endif
    bool transmits = transmits_kind(lobe.kind);
    if (!is_diffuse_kind(lobe.kind)) return is_found(light, transmits ? BY_GLOSSY + BY_TRANSMISSION : BY_GLOSSY);
    if (transmits) return is_found(light, BY_TRANSLUCENT);
    return is_found(light, BY_DIFFUSE) && (is_found(light, BY_GLOSSY) || !is_found(light, BY_CHAINS));
}

// What a point's lobes reflect of a light, times their cosines. Where rays of a lobe may find the light as well, this is
// the part of shadow rays of this density by the balance heuristic (Veach 1997, sec. 9.2); the kernel emitted has the
// other. `part`: of what gathers photons, by this ray, and nothing else if it goes by it.
vec3 eval_lobes(VisiblePoint point, Light light, float own, vec3 to_light, float part, bool by_lobe) {
    vec3 sum = vec3(0.0);
#ifdef PANES
    not_of_rays = vec3(0.0);
#endif
    int lobes = 1;
    float share = 1.0;  // of the first lobe, of the point's rays
#ifdef TWO_LOBES
    if (is_lobe(point.lobe1)) lobes = 2;
#endif
#ifdef WEIGHED
    bool is_weighed = (own > 0.0 || is_glow(light)) && point.bounces < float(chain_depth);
#ifdef SCATTERING
    is_weighed = is_weighed && !is_phase(point.lobe0);
#endif
#ifdef TWO_LOBES
    float cosine = dot(point.to_viewer, point.shading.normal);
    cosine = max(0.0, is_behind(point) ? -cosine : cosine);
    Shape rays0 = shape_of_rays(point.lobe0, point.shape0), rays1 = shape_of_rays(point.lobe1, point.shape1);
    if (is_weighed && lobes > 1) share = share_of_first(point.lobe0, rays0, point.lobe1, rays1, cosine);
#endif
    bool reflects = rays_that_reflect_find(light) || is_glow(light);
#endif
    // A loop, for compilers write out each call.
    for (int i = 0; i < lobes; i++) {
        Lobe lobe = point.lobe0;
        Shape shape = point.shape0;
#ifdef TWO_LOBES
        if (i > 0) {
            lobe = point.lobe1;
            shape = point.shape1;
            share = 1.0 - share;
        }
#endif
#ifdef TWO_SIDED
        if (is_behind(point) && !transmits_kind(lobe.kind)) continue;
#endif
        if (!is_found_for(light, lobe)) continue;
        vec3 normal = normal_of(point, lobe, shape);
        vec3 reflected = eval_lobe(lobe, shape, normal, point.to_viewer, to_light);
        reflected *= cosine_of(point, lobe, shape, to_light);
        float counts = 1.0;
#ifdef WEIGHED
        bool has_rays = is_weighed && (reflects || transmits_kind(lobe.kind));
        if (has_rays) {
            float density = pdf_lobe(lobe, shape, normal, point.to_viewer, to_light);
            counts = part_of_shadow_rays(own, share * density, lobe, shape);
        }
#endif
#ifdef SHADOW_RAYS_BY_LOBES
        float gathered = gathered_share(lobe, shape);
        counts = gathered * part + (by_lobe ? 0.0 : counts - gathered);
#endif
        sum += counts * reflected;
#ifdef PANES
#ifdef WEIGHED
        if (has_rays) {
#ifdef GATHERED_LOBES
            counts = min(counts, gathered_share(lobe, shape) * part);
#else
            counts = 0.0;
#endif
        }
#endif
#ifdef SCATTERING
        if (is_phase(lobe)) counts = 0.0;  // its rays alone go through glass, as all do in Cycles
#endif
        not_of_rays += counts * reflected;
#endif
    }
    return sum;
}
#endif
