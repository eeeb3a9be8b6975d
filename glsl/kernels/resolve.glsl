// SPDX-License-Identifier: GPL-3.0-or-later
// The picture of the sums of passes: film/picture.py on the device.
#include "lib/uncovered.glsl"

void kernel() {
    vec4 direct = load_direct().value / passes, background = load_background().value / passes;
    vec3 indirect = uncovered(load_indirect().value / passes, direct.a), mirrored = vec3(0.0);
    vec3 sum = direct.rgb + background.rgb;
#ifdef MIRRORED
    vec4 mirror = load_mirror().value / passes;
    mirrored = mirror.rgb + uncovered(load_mirror_indirect().value / passes, mirror.a);
#endif
#ifdef EMITTERS
    sum += of_emission * load_emission().value.rgb / passes;
#endif
    store_picture(Sum(vec4(sum + indirect + mirrored, clamp(background.a, 0.0, 1.0))));
    store_indirect_part(Sum(vec4(indirect, 0.0)));
    store_mirror_part(Sum(vec4(mirrored, 0.0)));
}
