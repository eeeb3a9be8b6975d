// SPDX-License-Identifier: GPL-3.0-or-later
// How far a material moves its surface at a point: what its program gives in place of a diffuse albedo, as Cycles has it
// (shader_setup_from_displace). So media are asked what they take, too (stage/densities.py).
#include "lib/program.glsl"

void kernel() {
    Hit hit = load_hit();
    if (!is_hit(hit)) skip();
    vec3 direction = load_direction().direction;
    Surface surface = surface_at(hit, direction);
    Material material = material_at(surface.material);
    shading_point = shading_point_at(hit, direction, surface);
    asking = vec4(0.0);  // no ray does, and none has come from anywhere
    shading_point.far = 0.0;
    run_program(material);
    store_way(Way(operand(material.albedo_from).xyz, 0.0));
}
