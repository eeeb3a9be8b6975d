// SPDX-License-Identifier: GPL-3.0-or-later
// The density at a cosine (or, for the spot, a versine). SAMPLE as in draw_sample.glsl.
#include "lib/sampling.glsl"
#include "lib/light.glsl"

void kernel() {
    float x = load_at().value.x;
#if SAMPLE == 0
    float density = pdf_cosine_hemisphere(x);
#elif SAMPLE == 1
    float density = pdf_phong_lobe(exponent, x);
#else
    float density = pdf_spot(light_at(0), x);
#endif
    store_value(Value(vec4(density)));
}
