// SPDX-License-Identifier: GPL-3.0-or-later
// Which lights a visible point's SHADOW_RAYS go to. It asks some lights each: one ray goes to each of these. Of all
// others it asks DRAWN at a time, which the tree draws; without DRAWN there are no others. Through portals go world_rays of
// a point, to the light of number world_light; -1: shadow rays go to no world, or to several.
#ifdef DRAWN
#include "lib/light_tree.glsl"
#endif
#include "lib/portals.glsl"

// How many of a point's shadow rays go to a light, in the mean.
float rays_to(int light, vec3 position, vec3 normal) {
#ifdef PORTALS
    if (light == world_light) return float(world_rays);
#endif
#ifdef DRAWN
    LightPlace place = light_place_at(light);
    return place.place < 0.0 ? 1.0 : float(DRAWN) * probability_of(place, position, normal);
#else
    return 1.0;
#endif
}

// Whether both shadow rays and rays of lobes may find it, of lobes that reflect or of lobes that let through: else there
// is nothing to weigh.
bool rays_that_reflect_find(Light light) { return is_found(light, BY_CHAINS) && is_found(light, BY_GLOSSY); }
bool rays_of_lobes_find(Light light) {
    return rays_that_reflect_find(light) || (is_found(light, BY_PASSING) && is_found(light, BY_TRANSMISSION));
}

// The density of so many shadow rays of a point in a direction to a light [1/sr]; 0 for one without size, and where
// there is nothing to weigh.
float density_of_rays(float rays, Light light, vec3 position, vec3 normal, vec3 to_light) {
    if (!rays_of_lobes_find(light)) return 0.0;
    return rays * pdf_asked(light, position, normal, to_light);
}
