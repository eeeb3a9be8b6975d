// SPDX-License-Identifier: GPL-3.0-or-later
// Say what the native core needs to gather photons with a Lambert lobe about a bent normal.
#include "lib/bent.glsl"
#include "lib/place.glsl"

void kernel() {
    vec3 geometric = load_facing().normal;
    if (!is_place(load_place())) skip();
    Bent bent = bent_of(geometric);
    store_base(Base(bent.base, bent.normal != geometric ? 1.0 : 0.0));
}
