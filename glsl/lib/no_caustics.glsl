// SPDX-License-Identifier: GPL-3.0-or-later
// Caustics that a scene does without, NO_CAUSTICS, as bits: Cycles leaves the lobes out that would cast them where a ray of
// a diffuse lobe comes.
#include "lib/lobe.glsl"
#include "lib/reach.glsl"

// The bit of light that a lobe sends in a direction.
int caustic_by(vec3 direction, vec3 geometric) {
    return dot(direction, geometric) < 0.0 ? REFRACTIVE_CAUSTICS : REFLECTIVE_CAUSTICS;
}

// Whether a kind of lobe casts caustics of all these bits, and the scene has none of them.
bool lacks(float kind, int caustics) {
#ifdef TRANSPARENT
    if (kind == float(TRANSPARENT)) return false;
#endif
    return !is_diffuse_kind(kind) && (NO_CAUSTICS & caustics) == caustics;
}

// Whether nothing is left of a lobe for such a ray.
bool is_left_out(float kind) {
    return lacks(kind, REFLECTIVE_CAUSTICS + (transmits_kind(kind) ? REFRACTIVE_CAUSTICS : 0));
}
