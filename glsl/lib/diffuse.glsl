// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's lobe at a point. Flags add up.
#include "lib/colour.glsl"

const float GATHERS = 1.0;  // photons land here
const float IS_HOLDOUT = -1.0;  // and nothing else: the eye sees nothing here
const float IS_COVERED = 2.0;  // lobe 0 lies over it, and the albedo does not lack that one's share yet

Diffuse bare_diffuse(vec3 albedo) { return Diffuse(albedo, largest(albedo) > 0.0 ? GATHERS : 0.0); }

Diffuse covered_diffuse(vec3 albedo) {
    return Diffuse(albedo, largest(albedo) > 0.0 ? GATHERS + IS_COVERED : 0.0);
}

bool is_diffuse(Diffuse diffuse) { return largest(diffuse.albedo) > 0.0; }

// Whether photons land here: also where nothing but other lobes gathers them.
bool gathers(Diffuse diffuse) { return diffuse.flags > 0.0; }
bool is_covered(Diffuse diffuse) { return diffuse.flags > GATHERS; }
bool is_holdout(Diffuse diffuse) { return diffuse.flags < 0.0; }

// The same point, where other lobes gather photons.
Diffuse with_photons(Diffuse diffuse) { return Diffuse(diffuse.albedo, max(diffuse.flags, GATHERS)); }
