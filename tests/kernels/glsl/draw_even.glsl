// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/even.glsl"

void kernel() {
    store_value(Value(vec4(even_over_passes(dimension), even_over_passes(dimension + 1u))));
}
