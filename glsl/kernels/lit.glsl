// SPDX-License-Identifier: GPL-3.0-or-later
// Add a light's radiance where its shadow ray got through.
#include "lib/records.glsl"

void kernel() {
    Radiance sum = load_sum();
    Radiance unshadowed = load_unshadowed();
    if (is_hit(load_hit())) unshadowed.radiance = vec3(0.0);
    store_total(Radiance(sum.radiance + unshadowed.radiance, 1.0));
}
