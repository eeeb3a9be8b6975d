// SPDX-License-Identifier: GPL-3.0-or-later
// Scattering of photons by a point's lobe besides Lambert's.
#include "lib/photon_point.glsl"
#include "lib/photon_visibility.glsl"
#ifdef ARRIVALS
#include "lib/arrival.glsl"
#endif
#ifdef LOBES
#include "lib/lobe.glsl"
#include "lib/reflection.glsl"
#ifdef NO_CAUSTICS
#include "lib/no_caustics.glsl"
#endif
#ifdef NORMALS
#include "lib/bent.glsl"
#endif

// Where the lobe, whose normal this is, would send a photon, and what that weighs; how likely it shall be scattered so:
// by what the lobe leaves of its flux in all, or in this way.
struct LobeSample { Lobe lobe; Shape shape; vec3 normal; vec3 axis; vec3 direction; vec3 weight; float probability; };

// `u`: the numbers by which the photon is reflected.
LobeSample sample_photon_lobe(PhotonPoint point, vec3 flux, vec4 u) {
    Lobe lobe = load_lobe0();
    Shape shape = load_shape0();
    vec3 to_light = -point.incoming, shading = point.shading.normal, geometric = point.facing.normal;
    vec3 normal = normal_of_lobe(lobe, shape, shading, geometric, to_light);
    Way way = lobe_way(lobe, shape, point.place.position, point.facing, normal, to_light, u);
    vec3 albedo = albedo_lobe(lobe, shape, max(0.0, dot(to_light, shading)));
    float probability = share_left(flux, albedo);
    float by_cosine = min(1.0, 2.0 * by_cosine_kind(lobe, shape));
    // Where some directions weigh much more than others, by what this one does; but few would go through portals.
#ifdef PORTALS_BY_SHARE
    if (way.by_portal > 0.0) probability /= 1.0 - way.by_portal;
    else
#endif
    probability = mix(probability, share_left(flux, way.weight), by_cosine);
    vec3 axis = axis_of_photons(lobe, normal, geometric);
    return LobeSample(lobe, shape, normal, axis, way.direction, way.weight, probability);
}

#ifdef VISIBILITY
int rays_of(Lobe lobe) {
    int rays = is_diffuse_kind(lobe.kind) ? RAY_DIFFUSE : RAY_GLOSSY;
#ifdef TRANSMITS
    if (transmits_kind(lobe.kind)) rays += RAY_TRANSMISSION;
#endif
    return rays;
}

bool may_scatter_by(Lobe lobe, Shape shape, RayAtSurface ray) {
#ifdef TRANSPARENT
    if (is_transparent(lobe)) return true;
#endif
    int rays = rays_of(lobe);
#ifdef NO_CAUSTICS
    if ((ray.came.rays & BY_CAUSTIC) != 0 && is_diffuse_kind(lobe.kind)) return false;
#endif
#ifdef SHADED_LAMPS
    if (!is_diffuse_kind(lobe.kind) && roughness_kind(lobe, shape) == 0.0) rays += IN_SHADE;
#endif
    return may_scatter(ray) && is_taken(ray, rays);
}
#endif

#ifdef SHADED_LAMPS
// Whether what is transparent but to lamps keeps shadow rays from where a lamp or an emissive mesh has sent the photon.
bool is_shading(PhotonPoint point, RayAtSurface ray) {
    if ((ray.came.rays & FROM_LAMP) == 0 || (ray.visible & RAY_SHADOW) == 0) return false;
    int material = int(triangle_at(int(point.shading.triangle)).material);
    return material_at(material).shades_lamps > 0.0;
}
#endif

void scatter_by_lobe(inout Leaving leaving, LobeSample by, PhotonPoint point, float probability, inout RayAtSurface ray) {
    vec3 geometric = point.facing.normal;
    leaving.photon.flux *= by.weight / probability;
    leaving.direction = by.direction;
#ifdef TRANSPARENT
    if (is_transparent(by.lobe)) {
        leaving.passes = true;
#ifdef SHADED_LAMPS
        leaving.is_in_shade = is_shading(point, ray);
        if (leaving.is_in_shade && (ray.came.rays & RAY_SHADOW) != 0) ray.came.rays = FROM_LAMP + IN_SHADE;
#endif
        pass_on(ray, ray.came.rays & ray.visible);
        return;
    }
#endif
    leaving.normal = by.axis;
    leaving.by_specular = !is_diffuse_kind(by.lobe.kind);
    // What flux that fell on the triangle is on the lobe, and leaves it (Veach 1997, sec. 5.3.2).
    float falls = dot(point.incoming, by.normal) / dot(point.incoming, geometric);
    leaving.photon.flux *= clamp(falls * dot(by.direction, geometric) / dot(by.direction, by.axis), 0.0, BRIGHTEST);
#ifdef NORMALS
    // In Cycles shadow rays alone lose light by it through the surface: photons that come straight from a light.
    if (is_softened_kind(by.lobe.kind) && (bounce == 0 || !transmits_kind(by.lobe.kind))) {
        leaving.photon.flux *= bump_shadowing(bent_of(geometric).base, by.normal, -point.incoming);
    }
#endif
#ifdef DISPERSION
    if (disperses_kind(by.lobe.kind)) leaving.photon = with_colour(leaving.photon);
#endif
#ifdef NO_CAUSTICS
    // The lobe is left out for diffuse rays: such a ray cannot have found the photon.
    if (lacks(by.lobe.kind, caustic_by(by.direction, geometric))) {
        ray.next.rays = (ray.next.rays & ~RAY_DIFFUSE) | BY_CAUSTIC;
    }
#endif
#if defined(TRANSMITS) && defined(VISIBILITY)
    int rays = dot(by.direction, geometric) < 0.0 ? RAY_TRANSMISSION : RAY_GLOSSY;
    if (leaving.by_specular && !is_taken(ray, rays + IN_SHADE)) leaving.photon.flux = vec3(0.0);
#endif
#ifdef ARRIVALS
    int finder = leaving.by_specular ? BY_GLOSSY : BY_DIFFUSE;
#ifdef TRANSMITS
    if (dot(by.direction, geometric) < 0.0) finder = leaving.by_specular ? BY_TRANSMISSION : BY_TRANSLUCENT;
#endif
#ifdef SCATTERING
    if (is_phase(by.lobe)) finder = BY_MEDIA;
#endif
    leaving.photon.flux *= share_of_arrival(load_origin(), point.place, finder);
#endif
}
#else
struct LobeSample { float probability; };

LobeSample sample_photon_lobe(PhotonPoint point, vec3 flux, vec4 u) { return LobeSample(0.0); }
void scatter_by_lobe(Leaving leaving, LobeSample by, PhotonPoint point, float probability, RayAtSurface ray) {}
#endif
