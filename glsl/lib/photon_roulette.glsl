// SPDX-License-Identifier: GPL-3.0-or-later
// With which probability a photon is scattered by which lobe of its point. Else it is absorbed, unless it goes through
// a portal, or behind a surface that is hidden from some of its rays.
#include "lib/colour.glsl"
#include "lib/photon_lobe.glsl"
#include "lib/reflection.glsl"
#ifdef PORTALS_FOR_ABSORBED

// Of what a diffuse surface scatters, what goes through portals at least.
const float LEAST_BY_PORTAL = 0.2;
#endif

struct Roulette {
    float diffuse;  // by Lambert's lobe, in a direction by the cosine
    float lobe;     // by the other one
#ifdef PORTALS_BY_SHARE
    Way way;
#endif
#ifdef PORTALS_FOR_ABSORBED
    float portal;   // by Lambert's lobe, in a direction through a portal
    float angles;   // of all portals that the point sees [sr]
#endif
};

// Photons that would be absorbed go through a portal instead. Weighed by the density of both ways together none gains
// flux, but for those on surfaces that are nearly white.
void give_portals_share(inout Roulette chance, PhotonPoint point, RayAtSurface ray) {
#ifdef PORTALS_FOR_ABSORBED
    if (chance.diffuse > 0.0 && !is_hidden(ray)) chance.angles = portals_angle(point.place.position, point.facing.normal);
    if (!(chance.angles > 0.0)) return;
    float absorbed = max(0.0, 1.0 - chance.diffuse - chance.lobe);
    chance.portal = max(absorbed, LEAST_BY_PORTAL * chance.diffuse);
    chance.diffuse -= chance.portal - absorbed;
#endif
}

// `u`: the numbers by which the photon is reflected.
Roulette roulette_of(PhotonPoint point, vec3 flux, LobeSample by_lobe, RayAtSurface ray, vec4 u) {
    Roulette chance;
    chance.diffuse = share_left(flux, point.diffuse.albedo);
#ifdef PORTALS_BY_SHARE
    // As many go by the cosine as without portals, unless there are too few to spare.
    chance.way = diffuse_way(point.place.position, point.facing, u);
    chance.diffuse /= 1.0 - chance.way.by_portal;
#endif
    chance.lobe = by_lobe.probability;
    float all = max(1.0, chance.diffuse + chance.lobe);
    chance.diffuse /= all;
    chance.lobe /= all;
#ifdef VISIBILITY
    // What the surface does not hide goes on behind it in the cases that are left, half of all at least.
    float share = is_hidden(ray) ? 0.5 : 1.0;
    chance.diffuse *= may_scatter(ray) && is_taken(ray, RAY_DIFFUSE) ? share : 0.0;
#ifdef LOBES
    chance.lobe *= may_scatter_by(by_lobe.lobe, by_lobe.shape, ray) ? share : 0.0;
#endif
#endif
#ifdef PORTALS_FOR_ABSORBED
    chance.portal = chance.angles = 0.0;
#endif
    give_portals_share(chance, point, ray);
    return chance;
}

// Whether a number in [0, 1) says that Lambert's lobe scatters the photon: by the cosine, or through a portal if it
// would be absorbed.
bool scatters_diffusely(Roulette chance, float u) {
#ifdef PORTALS_FOR_ABSORBED
    if (chance.angles > 0.0 && u >= chance.diffuse + chance.lobe) return true;
#endif
    return u < chance.diffuse;
}
