// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a photon came by a lobe that is not diffuse, where caustics are an image of their own: how far its ray may go
// says so, beside what photon_ray.glsl has there.
#include "lib/reach.glsl"

const int LOBE_BIT = 1 << 19;  // more than all numbers of photon_ray.glsl

bool came_by_lobe(RayDirection direction) { return reach_number(direction.t_max) >= LOBE_BIT; }

float t_max_by_lobe(float t_max) {
    int number = reach_number(t_max);
    return reach_of(number < LOBE_BIT ? number + LOBE_BIT : number);
}
