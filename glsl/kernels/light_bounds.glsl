// SPDX-License-Identifier: GPL-3.0-or-later
// Where each light is, and where it shines.
#include "lib/light.glsl"

void kernel() {
    int light = element_index();
    if (light >= light_count) skip();
    LightBounds bounds = bounds_light(light_at(light));
    store_low(LightLow(bounds.low, bounds.spread));
    store_high(LightHigh(bounds.high, bounds.reach));
    store_axis(LightAxis(bounds.axis, 1.0));
}
