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
#ifdef PORTALS_BY_SHARE

// Sharper lobes send nothing by portals, which they have little to gain by: what goes there is as bright by themselves.
// MOST_BY_PORTAL and WIDE_PORTAL: addon/photon/stage/portals.py.
const float LEAST_ROUGHNESS_BY_PORTAL = 0.1;

// The solid angle of all portals from a place [sr], and how likely a photon goes through one.
struct PortalChance { float angles; float share; };

PortalChance chance_of_portals(vec3 position, vec3 normal) {
    float angles = portals_angle(position, normal);
    return PortalChance(angles, angles > 0.0 ? MOST_BY_PORTAL * sqrt(min(1.0, angles / WIDE_PORTAL)) : 0.0);
}

// Whether a photon that goes through a portal misses it by rounding. It would weigh as if it went the other way, by
// which nearly none comes there.
bool is_lost(vec4 u, PortalChance seen, float by_portal) { return u.w < seen.share && !(by_portal > 0.0); }
#endif

// x is by what it is reflected, if it is, and y and z are where to.
vec4 reflection_numbers(Flux photon) {
    return random4(seed, pass_index + photon_part(photon), photon_number(photon), DIMENSION_REFLECT + uint(bounce));
}

// About the geometric normal: on it the photon's flux fell, and no direction leaves the wrong side, so the energy
// ledger closes whatever the shading normals are.
vec3 reflect_diffusely(Facing facing, vec4 u) { return frame_about(facing.normal) * sample_cosine_hemisphere(u.yz); }

// Where a photon is sent; how likely that is by a portal; and what it weighs, f cos / pdf, for Lambert's lobe over its
// albedo.
struct Way { vec3 direction; float by_portal; vec3 weight; };

Way diffuse_way(vec3 position, Facing facing, vec4 u) {
    Way way = Way(reflect_diffusely(facing, u), 0.0, vec3(1.0));
#ifdef PORTALS_BY_SHARE
    vec3 normal = facing.normal;
    PortalChance seen = chance_of_portals(position, normal);
    if (!(seen.share > 0.0)) return way;
    way.by_portal = seen.share;
    if (u.w < seen.share) way.direction = sample_portals(position, normal, seen.angles, u.yz);
    float by_cosine = pdf_cosine_hemisphere(dot(way.direction, normal));
    float by_portal = pdf_portals(position, normal, seen.angles, way.direction);
    way.weight = vec3(by_cosine / max(mix(by_cosine, by_portal, seen.share), 1.0e-30));
    if (is_lost(u, seen, by_portal)) way.weight = vec3(0.0);
#endif
    return way;
}

#ifdef LOBES
// The same by a lobe, whose normal this is: its weights are of the cosine about axis_of_photons.
Way lobe_way(Lobe lobe, Shape shape, vec3 position, Facing facing, vec3 normal, vec3 to_light, vec4 u) {
    Way way = Way(vec3(0.0), 0.0, vec3(0.0));
    vec3 axis = axis_of_photons(lobe, normal, facing.normal);
    way.direction = sample_lobe_for_photon(lobe, shape, normal, axis, to_light, u.yz, way.weight);
#ifdef PORTALS_BY_SHARE
    if (roughness_kind(lobe, shape) < LEAST_ROUGHNESS_BY_PORTAL) return way;
    PortalChance seen = chance_of_portals(position, facing.normal);
    if (!(seen.share > 0.0)) return way;
    way.by_portal = seen.share;
    if (u.w < seen.share) way.direction = sample_portals(position, facing.normal, seen.angles, u.yz);
    float cosine = max(0.0, dot(way.direction, axis));
    float by_lobe = pdf_lobe(lobe, shape, normal, to_light, way.direction);
    by_lobe = mix(by_lobe, pdf_cosine_hemisphere(cosine), by_cosine_kind(lobe, shape));
    float by_portal = pdf_portals(position, facing.normal, seen.angles, way.direction);
    float density = mix(by_lobe, by_portal, seen.share);
    way.weight = eval_lobe(lobe, shape, normal, way.direction, to_light) * (cosine / max(density, 1.0e-30));
    if (is_lost(u, seen, by_portal)) way.weight = vec3(0.0);
#endif
    return way;
}
#endif
