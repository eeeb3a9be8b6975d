// SPDX-License-Identifier: GPL-3.0-or-later
// How far a ray may go says what it is: any distance beyond the scene will do, and stands for a number from 1 on.
// Photons' numbers are those of photon_ray.glsl and specular_photon.glsl. A ray from the eye that a lobe has sent has that
// of its bits; the eye's own goes to its clip distance, which is less, through transparent surfaces, too.
#include "lib/constants.glsl"
#include "lib/ray_bits.glsl"

float reach_of(int number) { return T_MAX / float(number); }

// T_MAX over such a distance, both 2^-20 times as far: GPUs multiply by 1 over what they divide by, and of these that
// would be 0, for it is no normal number. By bits, for compilers would divide by the distance itself.
float times_in_reach(float t_max) {
    return (T_MAX * 9.5367431640625e-7) / uintBitsToFloat(floatBitsToUint(t_max) - (20u << 23));
}

int reach_number(float t_max) { return int(times_in_reach(t_max) + 0.5); }

// A ray that ends where a walk below the surface has come out (lib/random_walk.glsl).
const int EXIT = RAYS_OF_LOBES + 2;

bool is_exit(float t_max) { return abs(times_in_reach(max(t_max, 1.0)) - float(EXIT)) < 0.5; }

// Bits of what has sent a ray from the eye: by a diffuse lobe through the surface are two.
int sent_by_reach(float t_max) {
    if (is_exit(t_max)) return RAY_DIFFUSE;
    return t_max < reach_of(EXIT) ? RAY_CAMERA : reach_number(t_max) - 1;
}

// The bit of the surfaces that it meets: whatever has gone through one is of transmission.
int rays_by_reach(float t_max) {
    if (is_exit(t_max)) return ALL_RAYS;
    int sent = sent_by_reach(t_max);
    return (sent & RAY_TRANSMISSION) != 0 ? RAY_TRANSMISSION : sent;
}

// Whether a diffuse lobe has sent a ray from the eye, if it has gone straight on since.
bool is_by_diffuse(float t_max) { return (sent_by_reach(t_max) & RAY_DIFFUSE) != 0; }
