// SPDX-License-Identifier: GPL-3.0-or-later
// Which way a photon goes on from a surface. What lies over a lobe is weighed by that way, for it leads to the eye:
// so Shade draws it ahead, of the same numbers.
#include "lib/rng.glsl"
#include "lib/photon_number.glsl"
#include "lib/sampling.glsl"
#ifdef LOBES
#include "lib/lobe.glsl"
#endif
#ifdef PORTALS
#include "lib/openings.glsl"
#endif
#ifdef AHEAD

// Of what a diffuse surface scatters, what goes through portals at most; and from which solid angle of all [sr] on it is
// as much. It goes with the root of that: where photons start at all distances from what is shown alike, their flux
// goes with the square of the distance, and what of it comes there by the cosine with its third power. So each brings
// as much that goes through a portal.
const float MOST_BY_PORTAL = 0.4, WIDE_PORTAL = 0.25;
#endif

// x is by what it is reflected, if it is, and y and z are where to.
vec4 reflection_numbers(Flux photon) {
    return random4(seed, pass_index, photon_number(photon), DIMENSION_REFLECT + uint(bounce));
}

// About the geometric normal: on it the photon's flux fell, and no direction leaves the wrong side, so the energy
// ledger closes whatever the shading normals are.
vec3 reflect_diffusely(Facing facing, vec4 u) { return frame_about(facing.normal) * sample_cosine_hemisphere(u.yz); }

// Where a diffuse surface sends a photon; how likely that is by a portal, else by the cosine; and what the photon
// weighs, by the density of both ways over that of the cosine's.
struct DiffuseWay { vec3 direction; float by_portal; float weight; };

DiffuseWay diffuse_way(vec3 position, Facing facing, vec4 u) {
    DiffuseWay way = DiffuseWay(reflect_diffusely(facing, u), 0.0, 1.0);
#ifdef AHEAD
    float angles = portals_seen(position, facing.normal);
    if (!(angles > 0.0)) return way;
    way.by_portal = MOST_BY_PORTAL * sqrt(min(1.0, angles / WIDE_PORTAL));
    if (u.w < way.by_portal) way.direction = sample_portals(position, facing.normal, angles, u.yz);
    float by_cosine = pdf_cosine_hemisphere(dot(way.direction, facing.normal));
    float by_portal = pdf_portals(position, facing.normal, angles, way.direction);
    way.weight = by_cosine / max(mix(by_cosine, by_portal, way.by_portal), 1.0e-30);
#endif
    return way;
}
