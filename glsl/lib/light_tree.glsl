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

// How much light of a node may arrive, up to a factor; 0 only where there is none.
float importance(LightNode node, vec3 position, vec3 normal) {
    vec3 to_middle = 0.5 * (node.low + node.high) - position, reach = 0.5 * (node.high - node.low);
    float distance2 = dot(to_middle, to_middle), radius2 = dot(reach, reach);
    if (distance2 <= 1.0001 * radius2) return node.flux / max(radius2, 1.0e-30);
    vec3 to_light = to_middle * inversesqrt(distance2);
    float within = sqrt(1.0 - radius2 / distance2);  // the cosine of half the angle that the node fills
    float incident = normal == vec3(0.0) ? 1.0 : cosine_less(dot(to_light, normal), within);
#ifdef SMOOTH
    incident = max(incident, LEAST_INCIDENT);
#endif
    float off = -dot(to_light, node.axis);
    if (node.reach >= BOTH_SIDES) off = abs(off);
    float leaving = cosine_less(cosine_less(off, node.spread), within);
    if (incident <= 0.0 || leaving <= 0.0 || (node.reach < BOTH_SIDES && leaving < node.reach)) return 0.0;
    return node.flux * incident * leaving / distance2;
}

// The probability of a node's first child; below 0: nothing of either arrives.
float share_of_first(int node, vec3 position, vec3 normal) {
    float first = importance(light_node_at(2 * node), position, normal);
    float all = first + importance(light_node_at(2 * node + 1), position, normal);
    return all > 0.0 ? first / all : -1.0;
}

// The light that a number u in [0, 1) draws.
Drawn draw_light(vec3 position, vec3 normal, float u) {
    float probability = 1.0;
    int node = 1;
    while (node < light_leaves) {
        float share = share_of_first(node, position, normal);
        if (share < 0.0) return Drawn(0, 0.0);
        bool is_first = u < share;
        u = is_first ? u / share : (u - share) / (1.0 - share);
        probability *= is_first ? share : 1.0 - share;
        node = 2 * node + (is_first ? 0 : 1);
    }
    return Drawn(int(light_place_at(asked_lights + node - light_leaves).light), probability);
}

// With which probability that gives a light of the tree.
float probability_of(LightPlace place, vec3 position, vec3 normal) {
    float probability = 1.0;
    int leaf = light_leaves + int(place.place);
    for (int node = 1, below = light_leaves / 2; node < light_leaves; below /= 2) {
        float share = share_of_first(node, position, normal);
        if (share < 0.0) return 0.0;
        node = leaf / below;
        probability *= node % 2 == 0 ? share : 1.0 - share;
    }
    return probability;
}
