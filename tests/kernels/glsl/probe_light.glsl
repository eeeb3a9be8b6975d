// SPDX-License-Identifier: GPL-3.0-or-later
// The only light, by ASK: 0 a sample from a place by two numbers, 1 the density of a direction from a
// place, 2 what is emitted by four numbers, 3 its flux, 4 what a ray from a place sees of it, 5 a photon's flux.
#include "lib/light.glsl"

void kernel() {
    Light light = light_at(0);
    vec4 a = load_a().value, b = load_b().value;
    vec3 normal = load_c().value.xyz;
    vec4 first = vec4(0.0), second = vec4(0.0);
#if ASK == 0
    LightSample found = sample_light(light, a.xyz, normal, b.xy);
    first = vec4(found.to_light, found.far);
    second = vec4(found.irradiance, found.share);
#elif ASK == 1
    first = vec4(pdf_light(light, a.xyz, normal, b.xyz));
#elif ASK == 2
    LightRay emitted = emit_light(light, a.xy, b.xy);
    first = vec4(emitted.origin, emitted.weight);
    second = vec4(emitted.direction, 1.0);
#elif ASK == 3
    first = vec4(flux_light(light), 1.0);
#elif ASK == 5
    first = vec4(carried_light(light, b.xyz), 1.0);
#else
    first = seen_light(light, a.xyz, b.xyz, a.w);
#endif
    store_first(Value(first));
    store_second(Value(second));
}
