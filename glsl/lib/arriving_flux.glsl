// SPDX-License-Identifier: GPL-3.0-or-later
// What of a photon's flux reaches the surface that it meets.
#ifdef ABSORPTION
#include "lib/absorption.glsl"
#endif

vec3 arriving_flux(vec3 flux) {
#ifdef ABSORPTION
    flux *= left_by_absorption(load_medium(), load_hit(), load_facing().side);
#endif
    return flux;
}
