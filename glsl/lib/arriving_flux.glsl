// SPDX-License-Identifier: GPL-3.0-or-later
// What of a photon's flux reaches the surface that it meets.
#ifdef MEDIA
#include "lib/media.glsl"
#endif

vec3 arriving_flux(vec3 flux) {
#if defined(MEDIA) && !defined(SCATTERING)  // else, as where they vary, FreeFlight has taken it
    flux *= left_after(load_medium().inside, vec3(0.0), vec3(0.0), load_hit().t);
#endif
    return flux;
}
