// SPDX-License-Identifier: GPL-3.0-or-later
// What a lamp's nodes make of its colour, as an image: of an area light at each place on it, from its lower left
// corner; else in each direction, up against its axis.
#include "lib/environment.glsl"

// Where a place on an area light is in its image: from edge to edge.
vec2 pixels_on_area(Light light, Environment image, vec3 place) {
    vec3 local = (place - light.position) * mat3(light.across, cross(light.across, light.axis), light.axis);
    vec2 size = vec2(image.width, image.height);
    return clamp((local.xy / light.parameters.xy + 0.5) * size, vec2(0.5), size - 0.5);
}

// Of light that leaves a place in a direction.
vec3 gobo_colour(Light light, vec3 place, vec3 direction) {
    if (!(light.gobo_width > 0.0)) return vec3(1.0);
    Environment image = environment_at(light.gobo, light.gobo_width, light.gobo_height);
    vec3 local = direction * mat3(light.across, -cross(light.axis, light.across), -light.axis);
    vec2 pixels = light.kind == float(AREA_LIGHT) ? pixels_on_area(light, image, place) : place_in(image, local);
    Around found = around(image, pixels);
    return mix(found.low, found.high, found.part);
}
