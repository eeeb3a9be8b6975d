// SPDX-License-Identifier: GPL-3.0-or-later
// Photons that start where they count. Four numbers in [0, 1) tell where a photon starts, and where to: two for
// the direction, two for the place on the light, or, of a light afar, on a disc before the scene. A tree of
// boxes, each halved along an axis, says which numbers photons have that reach the picture. Uses the tables
// light_aims and aim_nodes.
#include "lib/constants.glsl"
#include "lib/light.glsl"
#include "lib/rng.glsl"

const int MOST_HALVINGS = 96;

// Turn plain numbers of a photon into those by the tree whose root is a node; the flux that it then has over what it
// has by plain ones.
float aim(int root, uint seed, uint pass_index, uint photon, inout vec4 numbers) {
    vec4 low = vec4(0.0), size = vec4(1.0);
    // What plain numbers have no digits for: each halving asks for more of them.
    vec4 rest = random4(seed, pass_index, photon, DIMENSION_AIM) * (1.0 / 16777216.0);
    float weight = 1.0;
    AimNode at = aim_node_at(root);
    for (int depth = 0; depth < MOST_HALVINGS && at.first > 0.0; depth++) {
        int axis = int(at.axis);
        bool is_low = numbers[axis] + rest[axis] < at.share;
        float share = is_low ? at.share : 1.0 - at.share;
        numbers[axis] = (numbers[axis] - (is_low ? 0.0 : at.share)) / share;
        rest[axis] /= share;
        size[axis] *= 0.5;
        if (!is_low) low[axis] += size[axis];
        weight *= 0.5 / share;
        at = aim_node_at(int(at.first) + (is_low ? 0 : 1));
    }
    numbers = clamp(low + size * clamp(numbers + rest, vec4(0.0), vec4(1.0)), vec4(0.0), vec4(BELOW_ONE));
    return weight;
}

// A photon of a light afar, which starts on a disc about the scene's middle, on one about another place instead, as wide
// as it takes to hold all of the first. Beyond that one no flux is left: there is nothing.
LightRay about_middle(LightRay emitted, vec3 middle, vec2 on_disc) {
    mat3 frame = frame_about(emitted.direction);
    float radius = -dot(emitted.origin, emitted.direction);
    vec2 aside = (middle * frame).xy;
    float reach = radius + length(aside);
    vec2 place = aside + reach * sample_disc(on_disc);
    emitted.weight *= dot(place, place) <= radius * radius ? reach * reach / (radius * radius) : 0.0;
    emitted.origin = frame * vec3(place, -radius);
    return emitted;
}
