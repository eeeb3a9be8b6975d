// SPDX-License-Identifier: GPL-3.0-or-later
// Scattering of photons by Lambert's lobe.
#include "lib/reflection.glsl"
#include "lib/photon_roulette.glsl"
#ifdef NORMALS
#include "lib/bent.glsl"
#endif

#ifdef PORTALS_FOR_ABSORBED
// Through a portal or by the cosine; what a photon of this direction weighs by the density of both ways.
vec3 scatter_beside_portals(PhotonPoint point, Roulette chance, vec4 u, inout vec3 direction) {
    vec3 position = point.place.position, normal = point.facing.normal;
    float which = clamp((u.x - chance.diffuse - chance.lobe) / chance.portal, 0.0, BELOW_ONE);
    if (u.x >= chance.diffuse) direction = sample_portals(position, normal, chance.angles, vec2(which, u.y));
    float by_cosine = pdf_cosine_hemisphere(dot(direction, normal));
    float by_portal = chance.portal * pdf_portals(position, normal, chance.angles, direction);
    return point.diffuse.albedo * by_cosine / max(chance.diffuse * by_cosine + by_portal, 1.0e-30);
}
#endif

void scatter_diffusely(inout Leaving leaving, PhotonPoint point, Roulette chance, vec4 u) {
    vec3 weight = point.diffuse.albedo / chance.diffuse;
#ifdef PORTALS_BY_SHARE
    leaving.direction = chance.way.direction;
    weight *= chance.way.weight;
#else
    leaving.direction = reflect_diffusely(point.facing, u);
#endif
#ifdef PORTALS_FOR_ABSORBED
    if (chance.angles > 0.0) weight = scatter_beside_portals(point, chance, u, leaving.direction);
#endif
    leaving.photon.flux *= weight;
#ifdef NORMALS
    Bent bent = bent_of(point.facing.normal);
    leaving.photon.flux *= bent_share(bent.base, bent.normal, point.facing.normal, -point.incoming);
#endif
#ifdef ARRIVALS
    leaving.photon.flux *= share_of_arrival(load_origin(), point.place, BY_DIFFUSE);
#endif
}
