// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow rays to the world: by the light's own density, and most of them through portals, where any are seen. A
// portal is a rectangle, such as a window, through which the world's light comes that the picture shows; they
// share their rays by solid angle. Uses the table portals.
#include "lib/light.glsl"

#ifdef PORTALS
#include "lib/openings.glsl"

const float SHARE_OF_PORTALS = 0.75;

// All solid angles of portals, of those lights whose rays they share; else 0.
float portals_for(Light light, vec3 position, vec3 normal) {
    return is_world(light) ? portals_angle(position, normal) : 0.0;
}
#endif

float pdf_asked(Light light, vec3 position, vec3 normal, vec3 to_light) {
    float density = pdf_light(light, position, normal, to_light);
#ifdef PORTALS
    float sum = portals_for(light, position, normal);
    if (sum > 0.0) density = mix(density, pdf_portals(position, normal, sum, to_light), SHARE_OF_PORTALS);
#endif
    return density;
}

// `is_direction`: only where to, and whether anything is there; its irradiance is what is seen there over pdf_asked.
LightSample sample_asked(Light light, vec3 position, vec3 normal, vec2 u, out bool is_direction) {
    is_direction = false;
#ifdef PORTALS
    float sum = portals_for(light, position, normal);
    if (sum > 0.0) {
        is_direction = true;
        LightSample found = LightSample(normal, T_MAX, vec3(0.0), 0.0);
        if (u.y < SHARE_OF_PORTALS) {
            found.to_light = sample_portals(position, normal, sum, vec2(u.y / SHARE_OF_PORTALS, u.x));
        } else {
            u.y = (u.y - SHARE_OF_PORTALS) / (1.0 - SHARE_OF_PORTALS);
            LightSample own = sample_light(light, position, normal, u);
            if (!(own.share > 0.0)) return own;
            found.to_light = own.to_light;
        }
        if (dot(normal, found.to_light) > 0.0) found.share = 1.0;
        return found;
    }
#endif
    return sample_light(light, position, normal, u);
}
