// SPDX-License-Identifier: GPL-3.0-or-later
// A sample for each pair of uniform numbers. SAMPLE: 0 cosine, 1 disc, 2 filter.
#include "lib/sampling.glsl"
#include "lib/density.glsl"

void kernel() {
    vec2 u = load_uniform_numbers().value.xy;
    vec3 value;
#if SAMPLE == 0
    value = sample_cosine_hemisphere(u);
#elif SAMPLE == 1
    value = vec3(sample_disc(u), 0.0);
#else
    value = vec3(sample_filter(u.x), 0.0, 0.0);
#endif
    store_value(Value(vec4(value, 1.0)));
}
