// SPDX-License-Identifier: GPL-3.0-or-later
// What a visible point's shadow ray is in where it begins.
#include "lib/media.glsl"
#include "lib/place.glsl"

Medium medium_towards(vec3 direction) {
    Medium medium = load_medium();
    Facing facing = load_facing();
#ifdef SCATTERING
    if (is_in_medium(load_place())) return medium;
#endif
    return dot(direction, facing.normal) < 0.0 ? medium_behind(medium, load_hit(), facing.side) : medium;
}
