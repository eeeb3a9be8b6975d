// SPDX-License-Identifier: GPL-3.0-or-later
// What an eye's ray is where visibility counts, by how far it may go. A ray of a lobe goes as far as there is something:
// any distance beyond the scene will do, and says which lobe's it is. The eye's own goes to its clip distance, which is
// less, through transparent surfaces, too.
#include "lib/constants.glsl"
#include "lib/ray_bits.glsl"

float reach_of(int rays) { return T_MAX / float(1 + rays); }

int rays_by_reach(float t_max) {
    float number = T_MAX / t_max;
    return number > float(RAYS_OF_LOBES) + 1.5 ? RAY_CAMERA : int(number + 0.5) - 1;
}
