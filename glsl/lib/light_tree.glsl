// SPDX-License-Identifier: GPL-3.0-or-later
// One of many lights, by what it may bring to a place: how far it is, and on which side of the surface and of the
// light (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"). Uses the
// tables of lights' nodes and places and the uniforms asked_lights and light_leaves.
//
// Node n has the children 2 n and 2 n + 1. The root is 1. Leaves are all of one level, and some are empty. Lights that
// every point asks are no part of the tree: the first of the places name them.
#include "lib/light.glsl"

// A light, and the probability with which it is drawn; 0: none.
struct Drawn { int light; float probability; };

// The cosine of an angle less another one; 1 if that is larger.
float cosine_less(float a, float b) {
    return a >= b ? 1.0 : a * b + sqrt(max(0.0, 1.0 - a * a)) * sqrt(max(0.0, 1.0 - b * b));
}

// Where light grazes it, a smooth surface is lit from below its triangles too.
const float LEAST_INCIDENT = 0.05;

// How much light of a node may arrive, up to a factor; 0 only where there is none. It is even if its lights shine to
// both sides, are far off for its size, and face about the same way: each then brings about as much of its flux.
struct Arrival { float importance; bool is_even; };

// With these a pass has 2 % more noise by a ball of 12288 triangles. Lanes of one go on until all are done, so what grazes is
// not left out: with it there would be nothing to gain.
const float FAR_OFF2 = 36.0;  // distance^2 over half the node's size^2
const float ALIKE = 0.85;     // a spread

Arrival arrival_of(LightNode node, vec3 position, vec3 normal) {
    vec3 to_middle = 0.5 * (node.low + node.high) - position, reach = 0.5 * (node.high - node.low);
    float distance2 = dot(to_middle, to_middle), radius2 = dot(reach, reach);
    if (distance2 <= 1.0001 * radius2) return Arrival(node.flux / max(radius2, 1.0e-30), false);
    vec3 to_light = to_middle * inversesqrt(distance2);
    float within = sqrt(1.0 - radius2 / distance2);  // the cosine of half the angle that the node fills
    float incident = normal == vec3(0.0) ? 1.0 : cosine_less(dot(to_light, normal), within);
#ifdef SMOOTH
    incident = max(incident, LEAST_INCIDENT);
#endif
    float off = -dot(to_light, node.axis);
    if (node.reach >= BOTH_SIDES) off = abs(off);
    float leaving = cosine_less(cosine_less(off, node.spread), within);
    bool is_dark = incident <= 0.0 || leaving <= 0.0 || (node.reach < BOTH_SIDES && leaving < node.reach);
    bool is_even = node.reach >= BOTH_SIDES && node.spread > ALIKE && distance2 > FAR_OFF2 * radius2;
    is_even = is_even && node.flux > 0.0;
    return Arrival(is_dark ? 0.0 : node.flux * incident * leaving / distance2, is_even);
}

// The probability of a node's first child, below 0: nothing of either arrives; and whether they are even.
struct Split { float first; bool is_even[2]; };

Split split_of(int node, vec3 position, vec3 normal) {
    Arrival first = arrival_of(light_node_at(2 * node), position, normal);
    Arrival other = arrival_of(light_node_at(2 * node + 1), position, normal);
    float all = first.importance + other.importance;
    return Split(all > 0.0 ? first.importance / all : -1.0, bool[2](first.is_even, other.is_even));
}

// The light that a number u in [0, 1) draws. Those of an even node it draws by flux.
Drawn draw_light(vec3 position, vec3 normal, float u) {
    float probability = 1.0;
    int node = 1;
    bool is_even = false;
    while (node < light_leaves && !is_even) {
        Split split = split_of(node, position, normal);
        if (split.first < 0.0) return Drawn(0, 0.0);
        bool is_first = u < split.first;
        u = is_first ? u / split.first : (u - split.first) / (1.0 - split.first);
        probability *= is_first ? split.first : 1.0 - split.first;
        is_even = is_first ? split.is_even[0] : split.is_even[1];
        node = 2 * node + (is_first ? 0 : 1);
    }
    float whole = light_node_at(node).flux;
    while (node < light_leaves) {
        float first = light_node_at(2 * node).flux, share = first / (first + light_node_at(2 * node + 1).flux);
        bool is_first = u < share;
        u = is_first ? u / share : (u - share) / (1.0 - share);
        node = 2 * node + (is_first ? 0 : 1);
    }
    if (is_even) probability *= light_node_at(node).flux / whole;
    return Drawn(int(light_place_at(asked_lights + node - light_leaves).light), probability);
}

// With which probability that gives a light of the tree.
float probability_of(LightPlace place, vec3 position, vec3 normal) {
    float probability = 1.0;
    int leaf = light_leaves + int(place.place), node = 1;
    bool is_even = false;
    for (int below = light_leaves / 2; node < light_leaves && !is_even; below /= 2) {
        Split split = split_of(node, position, normal);
        if (split.first < 0.0) return 0.0;
        node = leaf / below;
        bool is_first = node % 2 == 0;
        probability *= is_first ? split.first : 1.0 - split.first;
        is_even = is_first ? split.is_even[0] : split.is_even[1];
    }
    return is_even ? probability * light_node_at(leaf).flux / light_node_at(node).flux : probability;
}
