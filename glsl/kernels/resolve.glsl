// SPDX-License-Identifier: GPL-3.0-or-later
// The picture of the sums of passes: film/picture.py on the device.
#include "lib/uncovered.glsl"

// Of a sum of indirect light, whose alpha is the coverage.
vec3 whole(vec4 own, float weight, sampler2D indirect, sampler2D weights) {
    vec3 row = row_sum_of_light(indirect);
    Uncovering by = uncovering_of(own, weight, row, row_sum(indirect).a, row_sum(weights).a);
    return uncovered(by, max(own.rgb, 0.0), row);
}

void kernel() {
    vec4 direct = load_direct().value, background = load_background().value / passes;
    vec3 indirect = whole(load_indirect().value, direct.a, input_indirect, input_direct) / passes;
    vec3 sum = direct.rgb / passes + background.rgb, mirrored = vec3(0.0);
#ifdef MIRRORED
    vec4 mirror = load_mirror().value;
    mirrored = mirror.rgb + whole(load_mirror_indirect().value, mirror.a, input_mirror_indirect, input_mirror);
    mirrored /= passes;
#endif
#ifdef EMITTERS
    sum += of_emission * load_emission().value.rgb / passes;
#endif
    store_picture(Sum(vec4(sum + indirect + mirrored, clamp(background.a, 0.0, 1.0))));
    store_indirect_part(Sum(vec4(indirect, 0.0)));
    store_mirror_part(Sum(vec4(mirrored, 0.0)));
}
