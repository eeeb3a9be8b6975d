// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's lobe at a point. Flags add up.
#include "lib/colour.glsl"

const float IS_DIFFUSE = 1.0;  // photons land here
const float IS_COVERED = 2.0;  // lobe 0 lies over it, and the albedo does not lack that one's share yet

Diffuse bare_diffuse(vec3 albedo) { return Diffuse(albedo, largest(albedo) > 0.0 ? IS_DIFFUSE : 0.0); }

Diffuse covered_diffuse(vec3 albedo) {
    return Diffuse(albedo, largest(albedo) > 0.0 ? IS_DIFFUSE + IS_COVERED : 0.0);
}

bool is_diffuse(Diffuse diffuse) { return diffuse.flags > 0.0; }
bool is_covered(Diffuse diffuse) { return diffuse.flags > IS_DIFFUSE; }
