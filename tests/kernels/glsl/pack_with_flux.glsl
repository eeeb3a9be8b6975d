// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/packing.glsl"

void kernel() {
    vec3 flux = flux_with_direction(load_flux().value.xyz, load_direction().value.xyz);
    store_value(Value(vec4(flux, pack_direction(direction_with_flux(flux)))));
}
