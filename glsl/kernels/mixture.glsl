// SPDX-License-Identifier: GPL-3.0-or-later
// The mixture of the plain picture and the denoised one. The plain picture moved by w towards the other has the error
// noise - 2 w gained + w^2 apart.
#include "lib/mixture.glsl"

void kernel() {
    vec4 plain = load_picture().value, told = load_told().value;
    float kept = load_kept().value.x, moved = 1.0 - kept;
    vec3 smoothed = smooth_picture(load_clean().value.rgb, load_other_clean().value.rgb);
    vec3 mixed = kept * plain.rgb + moved * smoothed;
#ifdef EMISSION_APART
    mixed += load_emission().value.rgb / passes;
#endif
    store_mixed(Sum(vec4(mixed, plain.a)));
    store_left(Sum(vec4(told.x - moved * (2.0 * told.y - moved * told.z), told.x, 0.0, 0.0)));
}
