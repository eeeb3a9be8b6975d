// SPDX-License-Identifier: GPL-3.0-or-later
// What surfaces emit where a ray of the eye ends (EYE), or for what they light.
#include "lib/program.glsl"
#ifdef EYE
#include "lib/bounces.glsl"
#endif

void kernel() {
    Hit hit = load_hit();
    if (!is_hit(hit)) skip();
    vec3 direction = load_direction().direction;
    Surface surface = surface_at(hit, direction);
    Material material = material_at(surface.material);
    vec3 emission = material.emission;
    if (is_given(material.emission_from)) {
        shading_point = shading_point_at(hit, direction, surface);
#ifdef EYE
        ask_as_eye_ray();
#else
        ask_as_light();
#endif
        run_program(material);
        emission = radiance_from(material.emission_from);
    }
    store_emission(Radiance(emission, 1.0));
}
