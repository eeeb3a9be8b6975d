// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a photon came by a lobe that is not diffuse, where caustics are an image of their own: how far its ray may go
// says so, beside what photon_ray.glsl has there.
#include "lib/constants.glsl"

const int LOBE_BIT = 1 << 19;  // more than all numbers of photon_ray.glsl

int t_max_number(float t_max) { return int(T_MAX / t_max + 0.5); }

bool came_by_lobe(RayDirection direction) { return t_max_number(direction.t_max) >= LOBE_BIT; }

float t_max_by_lobe(float t_max) {
    int number = t_max_number(t_max);
    return T_MAX / float(number < LOBE_BIT ? number + LOBE_BIT : number);
}
