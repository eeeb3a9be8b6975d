// SPDX-License-Identifier: GPL-3.0-or-later
// Light from afar that glass with parallel faces lets go on as it came: shadow rays bring it, bent at each face as it
// was, and photons that come so are not deposited. Both ask here what is straight.
#include "lib/packing.glsl"

// Cosine between the normals of a face that is flat (FLAT in stage/panes.py), and between directions that are the
// same, of which a photon's is packed.
const float FLAT = 0.999999;
const float STRAIGHT = 0.999992;

// Of photons: packed, the direction in which such a light has sent it if it has since been refracted by flat faces of
// clear glass alone, plus one; below 0 where it has met no glass yet; else 0.
float sent_along(vec3 direction) { return 1.0 + pack_direction(direction); }

bool is_straight(float sent, vec3 direction) {
    return sent > 0.0 && dot(unpack_direction(sent - 1.0), direction) > STRAIGHT;
}
