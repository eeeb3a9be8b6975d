// SPDX-License-Identifier: GPL-3.0-or-later
// The flux that each light emits.
#include "lib/light.glsl"

void kernel() {
    int light = element_index();
    if (light >= light_count) skip();
    store_flux(Flux(flux_light(light_at(light)), float(light)));
}
