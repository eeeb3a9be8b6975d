// SPDX-License-Identifier: GPL-3.0-or-later
// What a lamp's nodes make of its colour in each direction, as an image: up is against its axis.
#include "lib/environment.glsl"

vec3 gobo_colour(Light light, vec3 direction) {
    if (!(light.gobo_width > 0.0)) return vec3(1.0);
    Environment image = environment_at(light.gobo, light.gobo_width, light.gobo_height);
    Around found = around(image, direction * mat3(light.across, -cross(light.axis, light.across), -light.axis));
    return mix(found.low, found.high, found.part);
}
