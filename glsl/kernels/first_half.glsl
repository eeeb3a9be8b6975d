// SPDX-License-Identifier: GPL-3.0-or-later
// The picture of half of the passes, with the coverage of all: first_half of film/picture.py on the device.
#include "lib/uncovered.glsl"

// What is added to light of half of the passes, as to that of all.
vec3 added(vec3 light, vec4 own, float weight, sampler2D half_indirect, sampler2D indirect, sampler2D weights) {
    float covered = row_sum(indirect).a;
    Uncovering by = uncovering_of(own, weight, row_sum_of_light(indirect), covered, row_sum(weights).a);
    return uncovered(by, light, row_sum(half_indirect).rgb) - light;
}

void kernel() {
    vec3 sum = load_half_combined().value.rgb;
#ifdef EMISSION_APART
    sum -= load_half_emission().value.rgb;
#endif
    vec3 light = load_half_indirect().value.rgb;
    float weight = load_direct().value.a;
    sum += added(light, load_indirect().value, weight, input_half_indirect, input_indirect, input_direct);
#ifdef MIRRORED
    light = load_half_mirror_indirect().value.rgb;
    vec4 own = load_mirror_indirect().value;
    weight = load_mirror().value.a;
    sum += added(light, own, weight, input_half_mirror_indirect, input_mirror_indirect, input_mirror);
#endif
    store_first_half(Sum(vec4(sum / half_passes, 0.0)));
}
