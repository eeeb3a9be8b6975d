// SPDX-License-Identifier: GPL-3.0-or-later
// Which way a photon goes on from a surface. What lies over a lobe is weighed by that way, for it leads to the eye:
// so Shade draws it ahead, of the same numbers.
#include "lib/rng.glsl"
#include "lib/photon_number.glsl"
#include "lib/sampling.glsl"
#ifdef LOBES
#include "lib/lobe.glsl"
#endif

// x is by what it is reflected, if it is, and y and z are where to.
vec4 reflection_numbers(Flux photon) {
    return random4(seed, pass_index, photon_number(photon), DIMENSION_REFLECT + uint(bounce));
}

// About the geometric normal: on it the photon's flux fell, and no direction leaves the wrong side, so the energy
// ledger closes whatever the shading normals are.
vec3 reflect_diffusely(Facing facing, vec4 u) { return frame_about(facing.normal) * sample_cosine_hemisphere(u.yz); }
