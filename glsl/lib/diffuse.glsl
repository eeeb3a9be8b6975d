// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's lobe at a point. Flags add up.
#include "lib/colour.glsl"
#include "lib/packing.glsl"

const float GATHERS = 1.0;  // photons land here
const float IS_HOLDOUT = -1.0;  // and nothing else, less what is let through: the eye sees nothing but what is behind
const float IS_DISPLACED = 4.0;  // the smooth surface's normal is not the mesh's: see with_base

Diffuse bare_diffuse(vec3 albedo) { return Diffuse(albedo, largest(albedo) > 0.0 ? GATHERS : 0.0); }

bool is_diffuse(Diffuse diffuse) { return largest(diffuse.albedo) > 0.0; }

// Whether photons land here: also where nothing but other lobes gathers them.
bool gathers(Diffuse diffuse) { return diffuse.flags > 0.0; }
bool is_holdout(Diffuse diffuse) { return diffuse.flags < 0.0 && diffuse.flags > -IS_DISPLACED; }

Diffuse held_out(float let_through) { return Diffuse(vec3(0.0), IS_HOLDOUT - min(let_through, 2.0)); }
float let_through_by(Diffuse holdout) { return IS_HOLDOUT - holdout.flags; }

// The same point, where other lobes gather photons.
Diffuse with_photons(Diffuse diffuse) { return Diffuse(diffuse.albedo, max(diffuse.flags, GATHERS)); }

// The same for photons: they land by the whole material, as coverage counts its triangles, also where a texture
// leaves nothing of its albedo.
Diffuse with_photons(Diffuse diffuse, bool lands) { return Diffuse(diffuse.albedo, lands ? GATHERS : 0.0); }

// The same where the smooth surface's normal is this: as many times IS_DISPLACED as say so, below 0 where no photons
// land. Once: the shading normal is; else it is packed, to 0.001.
const float STEPS_OF_BASE = 2046.0;  // so that all flags are below 2^24

Diffuse with_base(Diffuse diffuse, vec3 base, vec3 shading) {
    float times = base == shading ? 1.0 : 2.0 + pack_octahedral(base, STEPS_OF_BASE);
    times *= IS_DISPLACED;
    return Diffuse(diffuse.albedo, gathers(diffuse) ? diffuse.flags + times : -times);
}

bool is_displaced(Diffuse diffuse) { return abs(diffuse.flags) >= IS_DISPLACED; }

vec3 base_of(Diffuse diffuse, vec3 shading) {
    float times = floor(abs(diffuse.flags) / IS_DISPLACED);
    return times > 1.0 ? normalize(unpack_octahedral(times - 2.0, STEPS_OF_BASE)) : shading;
}
