// SPDX-License-Identifier: GPL-3.0-or-later
// The picture of half of the passes, with the coverage of all: first_half of film/picture.py on the device.
#include "lib/uncovered.glsl"

// What dividing by the coverage adds to light.
vec3 uncovering(vec3 light, float coverage, float weight) {
    return over_coverage(light, coverage, weight, light) - light;
}

void kernel() {
    vec3 sum = load_half_combined().value.rgb;
#ifdef EMISSION_APART
    sum -= load_half_emission().value.rgb;
#endif
    sum += uncovering(load_half_indirect().value.rgb, load_indirect().value.a, load_direct().value.a);
#ifdef MIRRORED
    sum += uncovering(load_half_mirror_indirect().value.rgb, load_mirror_indirect().value.a, load_mirror().value.a);
#endif
    store_first_half(Sum(vec4(sum / half_passes, 0.0)));
}
