// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/rng.glsl"

void kernel() {
    store_value(Value(photon_sequence(seed, pass_index, uint(element_index()), photons)));
}
