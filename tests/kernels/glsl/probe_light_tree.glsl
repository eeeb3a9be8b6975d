// SPDX-License-Identifier: GPL-3.0-or-later
// By ASK: 0 the light that a number draws at a place, and with which probability it is drawn; 1 the probability of a
// light of the tree at a place, and which place in the tree it has; 2 what a light emits by four numbers.
#include "lib/light_tree.glsl"

void kernel() {
    vec4 a = load_a().value;
    vec3 normal = load_b().value.xyz;
#if ASK == 0
    Drawn drawn = draw_light(a.xyz, normal, a.w);
    store_first(Value(vec4(float(drawn.light), drawn.probability, 1.0, 1.0)));
    store_second(Value(vec4(0.0, 0.0, 0.0, 1.0)));
#elif ASK == 1
    LightPlace place = light_place_at(int(a.w));
    float probability = place.place < 0.0 ? 0.0 : probability_of(place, a.xyz, normal);
    store_first(Value(vec4(probability, place.place, 1.0, 1.0)));
    store_second(Value(vec4(0.0, 0.0, 0.0, 1.0)));
#else
    LightRay emitted = emit_light(light_at(int(a.w)), a.xy, normal.xy);
    store_first(Value(vec4(emitted.origin, 1.0)));
    store_second(Value(vec4(emitted.direction, 1.0)));
#endif
}
