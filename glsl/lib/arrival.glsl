// SPDX-License-Identifier: GPL-3.0-or-later
// The factor on a photon's flux where it first lands, so that it brings what a shadow ray from there would find: by the
// kinds of surfaces that find its light, by that light's falloff, and of soft discs by how much of one is seen.
#include "lib/light.glsl"
#include "lib/from_light.glsl"
#include "lib/place.glsl"
#ifdef LINKED
#include "lib/linked.glsl"
#endif

// The share of a photon's flux that a kind of surface may have, by one of the bits of shadow rays.
float share_of_arrival(RayOrigin origin, Place at, int by) {
    if (!is_from_light(origin)) return 1.0;
    Light light = light_at(light_of(origin));
    if (!is_found(light, by)) return 0.0;
#ifdef LINKED
    if (!lights_surface(light, surface_number(at))) return 0.0;
#endif
    if (has_passed(origin)) return 1.0;  // nobody knows how far it has come
    vec3 place = at.position, way = place - origin.position;
    float far = length(way);
    // A disc that faces whoever looks: from nearby, less of it is seen than of what it is from afar.
    if (is_soft(light) && !(seen_light(light, place, -way / far, T_MAX).w > 0.0)) return 0.0;
    return share_at(light, far);
}
