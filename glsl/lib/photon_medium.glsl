// SPDX-License-Identifier: GPL-3.0-or-later
// What absorbs a photon's flux on its next way.
#include "lib/photon_point.glsl"
#ifdef ABSORPTION
#include "lib/absorption.glsl"
#endif

void carry_medium(Leaving leaving) {
#ifdef ABSORPTION
    Facing facing = load_facing();
    bool goes_behind = dot(leaving.direction, facing.normal) < 0.0 && !leaving.is_unmet;
    store_next_medium(goes_behind ? medium_behind(load_medium(), load_hit(), facing.side) : load_medium());
#endif
}
