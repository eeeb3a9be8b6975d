// SPDX-License-Identifier: GPL-3.0-or-later
// What a visible point's shadow ray is in where it begins.
#include "lib/media.glsl"
#include "lib/place.glsl"

Medium medium_towards(vec3 direction) {
    Medium medium = load_medium();
    Facing facing = load_facing();
    bool goes_behind = dot(direction, facing.normal) < 0.0;
#ifdef SCATTERING
    goes_behind = goes_behind && !is_in_medium(load_place());
#endif
    if (goes_behind) medium = medium_behind(medium, load_hit(), facing.side);
    vec2 inside = medium.inside;
    for (int i = 0; i < MOST_MEDIA && inside != vec2(0.0); i++) {
        float number = medium_number(inside, i);
        if (number > 0.0 && interior_at(int(number) - 1).unshadowing > 0.0) medium.inside -= at_place(number, i);
    }
    return medium;
}
