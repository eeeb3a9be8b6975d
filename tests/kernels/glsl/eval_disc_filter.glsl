// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/density.glsl"

void kernel() {
    float d = load_distance().value.x;
    store_value(Value(vec4(filter_peak(radius * radius) * filter_shape(d * d / (radius * radius)))));
}
