// SPDX-License-Identifier: GPL-3.0-or-later
// Directions through portals, rectangles that share them by solid angle. Uses a table of PORTAL, of which a program has
// one. With ONE_WAY portals are seen from the side alone that their axes point to, and all points of one are as likely:
// photons, whose other ways bound what they bring, need no angles to a rounding.
#include "lib/spherical_rectangle.glsl"

#ifdef ONE_WAY
const float LEAST_ANGLE_OF_PORTAL = 1.0e30;
#else
const float LEAST_ANGLE_OF_PORTAL = 5.0e-3;  // [sr] below, sums of angles are not precise enough
// Of half a side: a direction to an edge may miss the portal by a rounding, and then it would be as rare, and count as much,
// as one that was not meant for it.
const float WITHIN_PORTAL = 0.9999;
#endif

// A portal as a place sees it: that one by the portal's frame, on the side where z is positive, and the rectangle's
// corners; its solid angle [sr]; 0: none of it is above the surface, or seen from there.
struct PortalFrom { Portal portal; vec3 place; vec2 low; vec2 high; float angle; };

vec3 in_portal(Portal portal, vec2 at) {
    return at.x * portal.across + at.y * cross(portal.axis, portal.across);
}

PortalFrom portal_from(int number, vec3 position, vec3 normal) {
    Portal portal = portal_at(number);
    vec3 away = position - portal.middle;
    vec2 up = 0.5 * vec2(portal.width, portal.height);
    float height = dot(away, portal.axis);
#ifndef ONE_WAY
    height = abs(height);
#endif
    vec3 place = vec3(dot(away, portal.across), dot(away, cross(portal.axis, portal.across)), height);
    PortalFrom seen = PortalFrom(portal, place, -up, up, 0.0);
    vec2 slope = vec2(dot(normal, portal.across), dot(normal, cross(portal.axis, portal.across)));
    if (!(dot(abs(slope), up) > dot(normal, away)) || !(place.z > 0.0)) return seen;
#ifndef ONE_WAY
    seen.angle = rectangle_solid_angle(place, -up, up);
#endif
    float far = max(length(away), 1.0e-6);
    if (!(seen.angle > LEAST_ANGLE_OF_PORTAL)) seen.angle = portal.width * portal.height * place.z / (far * far * far);
    return seen;
}

// All solid angles [sr]. Those that are there are the first ones.
float portals_angle(vec3 position, vec3 normal) {
    float sum = 0.0;
    for (int i = 0; i < PORTALS && portal_at(i).width > 0.0; i++) sum += portal_from(i, position, normal).angle;
    return sum;
}

vec3 sample_portals(vec3 position, vec3 normal, float sum, vec2 u) {
    float before = 0.0;
    PortalFrom seen = portal_from(0, position, normal);
    for (int i = 1; i < PORTALS && portal_at(i).width > 0.0 && before + seen.angle <= u.x * sum; i++) {
        PortalFrom next = portal_from(i, position, normal);
        if (!(next.angle > 0.0)) continue;
        before += seen.angle;
        seen = next;
    }
    u.x = clamp((u.x * sum - before) / max(seen.angle, 1.0e-30), 0.0, BELOW_ONE);
    vec2 met = mix(seen.low, seen.high, u);
    if (seen.angle > LEAST_ANGLE_OF_PORTAL) met = sample_spherical_rectangle(seen.place, seen.low, seen.high, u);
#ifndef ONE_WAY
    met = clamp(met, WITHIN_PORTAL * seen.low, WITHIN_PORTAL * seen.high);
#endif
    return normalize(seen.portal.middle + in_portal(seen.portal, met) - position);
}

// [1/sr]
float pdf_portals(vec3 position, vec3 normal, float sum, vec3 to_light) {
    float density = 0.0;
    for (int i = 0; i < PORTALS && portal_at(i).width > 0.0; i++) {
        PortalFrom seen = portal_from(i, position, normal);
        if (!(seen.angle > 0.0)) continue;
        vec3 axis = seen.portal.axis, across = seen.portal.across;
        float toward = dot(to_light, axis) * sign(dot(seen.portal.middle - position, axis));
        if (!(toward > 0.0)) continue;
        float far = seen.place.z / toward;
        vec2 met = seen.place.xy + far * vec2(dot(to_light, across), dot(to_light, cross(axis, across)));
        if (any(greaterThan(abs(met), seen.high))) continue;
        bool by_angle = seen.angle > LEAST_ANGLE_OF_PORTAL;
        density += by_angle ? 1.0 : seen.angle * far * far / (seen.portal.width * seen.portal.height * toward);
    }
    return density / sum;
}
