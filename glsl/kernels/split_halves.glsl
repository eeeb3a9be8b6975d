// SPDX-License-Identifier: GPL-3.0-or-later
// Both halves of a picture in units of a light, without what is below zero and what is too bright, and the features'
// means: as a denoiser is given them. Of one pass the halves are the same.
#include "lib/mixture.glsl"

void kernel() {
    Lights lights = lights_of(load_picture().value.rgb, load_half().value.rgb);
    store_first(Sum(vec4(lights.first - lights.beyond, 0.0)));
    store_other(Sum(vec4(lights.other - lights.beyond, 0.0)));
    store_albedo(Sum(load_albedo_sum().value / passes));
    store_normal(Sum(load_normal_sum().value / passes));
}
