// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/lobe_weight.glsl"

void kernel() {
    store_found(Value(vec4(unpacked_weight(packed_weight(load_weights().value.rgb)), 0.0)));
}
