// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/material.glsl"

void kernel() {
    Material m = material_at(0.0);
    vec3 a = load_towards_light().value.xyz, b = load_towards_viewer().value.xyz;
    store_value(Value(vec4(eval_brdf(m, vec3(0.0, 0.0, 1.0), a, b), 0.0)));
}
