// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/packing.glsl"

void kernel() {
    float code = pack_direction(load_direction().value.xyz);
    store_value(Value(vec4(unpack_direction(code), code)));
}
