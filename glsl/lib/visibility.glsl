// SPDX-License-Identifier: GPL-3.0-or-later
// Which rays meet a surface. VISIBILITY has the bits of those that a program traces. Uses the table of visibility.
#include "lib/ray_bits.glsl"
#include "lib/constants.glsl"

const int HOLDOUT = 64;  // a bit of surfaces

// Of a surface by its number.
int visibility_of(float surface) {
#ifdef SCATTERING
    if (surface == IN_MEDIUM) return ALL_RAYS;
#endif
    return int(visibility_at(int(surface)).rays);
}
