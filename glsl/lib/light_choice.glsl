// SPDX-License-Identifier: GPL-3.0-or-later
// Which light, by the flux that each emits. Uses the uniform light_count.
//
// A visible point asks SHADOW_RAYS lights: all there are, or where DRAWN, so many by chance.
#include "lib/light.glsl"

// The light at a share of all flux, u in [0, 1).
int choose_light(float u) {
    int low = 0, high = light_count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (u < light_at(middle).cdf) high = middle; else low = middle + 1;
    }
    return low;
}

// How many of a point's shadow rays go to a light, in the mean.
float rays_to(Light light) {
#ifdef DRAWN
    return float(SHADOW_RAYS) * light.chosen;
#else
    return 1.0;
#endif
}

// The density of a point's shadow rays in a direction to a light [1/sr]; 0 for one without size, and for one that
// either they or rays of lobes do not find: then there is nothing to weigh.
float density_of_rays_to(Light light, vec3 position, vec3 normal, vec3 to_light) {
    if (!is_found(light, BY_CHAINS) || !is_found(light, BY_GLOSSY)) return 0.0;
    return rays_to(light) * pdf_light(light, position, normal, to_light);
}
