// SPDX-License-Identifier: GPL-3.0-or-later
// Photons of surfaces that emit by the cosine, half of which go through the faces of the box about what is shown: of a
// dome of a kilometre else none would come there. Uses a table of PORTAL, of a box's faces.
#include "lib/rng.glsl"
#include "lib/sampling.glsl"
#include "lib/openings.glsl"

const float EMITTED_BY_PORTAL = 0.5;

LightRay through_portals(Light light, LightRay ray, uint pass_index, uint photon) {
    vec3 normal = cosine_axis_light(light, ray.direction);
    float angles = normal == vec3(0.0) ? 0.0 : portals_angle(ray.origin, normal);
    if (!(angles > 0.0)) return ray;
    vec4 u = random4(seed, pass_index, photon, DIMENSION_LIGHT_PORTAL);
    bool goes_by_portal = u.x < EMITTED_BY_PORTAL;
    if (goes_by_portal) ray.direction = sample_portals(ray.origin, normal, angles, u.yz);
    float by_cosine = pdf_cosine_hemisphere(dot(ray.direction, normal));
    float by_portal = pdf_portals(ray.origin, normal, angles, ray.direction);
    ray.weight *= by_cosine / max(mix(by_cosine, by_portal, EMITTED_BY_PORTAL), 1.0e-30);
    if (goes_by_portal && !(by_portal > 0.0)) ray.weight = 0.0;  // it misses the face by rounding
    return ray;
}
