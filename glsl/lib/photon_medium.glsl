// SPDX-License-Identifier: GPL-3.0-or-later
// What absorbs a photon's flux on its next way, and whether it is light that has come straight through glass.
#include "lib/photon_point.glsl"
#ifdef ABSORPTION
#include "lib/absorption.glsl"
#endif
#ifdef PANES
#include "lib/pane.glsl"

// Whether what has sent it on is a flat face of clear glass, or let it pass as if nothing were there.
bool stays_straight(Leaving leaving, Facing facing, bool goes_behind) {
    if (dot(leaving.direction, load_direction().direction) > FLAT) return true;
    bool is_flat = abs(dot(leaving.normal, facing.normal)) >= FLAT;
    return goes_behind && is_flat && material_at(int(triangle_at(hit_triangle(load_hit())).material)).pane > 0.0;
}
#endif

void carry_medium(Leaving leaving) {
#ifdef ABSORPTION
    Facing facing = load_facing();
    bool goes_behind = dot(leaving.direction, facing.normal) < 0.0 && !leaving.is_unmet;
    Medium medium = load_medium();
    if (goes_behind) medium = medium_behind(medium, load_hit(), facing.side);
#ifdef PANES
    if (!stays_straight(leaving, facing, goes_behind)) medium.sent = 0.0;
#endif
    store_next_medium(medium);
#endif
}
