// SPDX-License-Identifier: GPL-3.0-or-later
// Which media a photon is in on its next way, and whether it is light that has come straight through glass.
#include "lib/photon_point.glsl"
#ifdef MEDIA
#include "lib/media.glsl"
#endif
#ifdef PANES
#include "lib/pane.glsl"

// What stays of the direction in which light from afar was sent (pane.glsl).
float sent_on(float sent, Leaving leaving, Facing facing, bool goes_behind) {
    if (leaving.is_in_shade) return 0.0;  // no shadow ray brings it
    if (leaving.is_unmet || leaving.passes) return sent;
#ifdef SCATTERING
    if (is_scattered(load_hit())) return 0.0;
#endif
    bool is_flat = abs(dot(leaving.normal, facing.normal)) >= FLAT;
    bool by_pane = goes_behind && is_flat && material_at(int(triangle_at(hit_triangle(load_hit())).material)).pane > 0.0;
    return by_pane ? abs(sent) : 0.0;
}
#endif

void carry_medium(Leaving leaving) {
#ifdef MEDIA
    Facing facing = load_facing();
    bool goes_behind = dot(leaving.direction, facing.normal) < 0.0 && !leaving.is_unmet;
    Medium medium = load_medium();
#ifdef SCATTERING
    // Straight from its light it is below 0.
    if (is_scattered(load_hit())) {
        goes_behind = false;
        medium.scattered += 1.0;
    } else if (!leaving.passes && !leaving.is_unmet) {
        medium.scattered = max(medium.scattered, 0.0);
    }
#endif
    if (goes_behind) medium = medium_behind(medium, load_hit(), facing.side);
#ifdef PANES
    medium.sent = sent_on(medium.sent, leaving, facing, goes_behind);
#endif
    store_next_medium(medium);
#endif
}
