// SPDX-License-Identifier: GPL-3.0-or-later
// Which light a photon starts at. Uses the uniform light_count.
#include "lib/light.glsl"

// The light at a share of all that is chosen, u in [0, 1).
int choose_light(float u) {
    int low = 0, high = light_count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (u < light_at(middle).cdf) high = middle; else low = middle + 1;
    }
    return low;
}
