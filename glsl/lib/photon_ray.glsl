// SPDX-License-Identifier: GPL-3.0-or-later
// What a photon's ray is where visibility counts. The path from the eye goes it the other way: a photon from A that
// scatters at B by a lobe was found at A by a ray of that lobe, and one from a light by a shadow ray. So surfaces
// that are not visible to such a ray do not end it, and B itself need not be. It is not known yet what B is: a
// photon has the bits of all rays that may have sent it, and surfaces take from these.
#include "lib/reach.glsl"
#ifdef CAUSTICS
#include "lib/specular_photon.glsl"
#endif

// Bits beside those of rays, with SHADED_LAMPS: a lamp or an emissive mesh has sent it; and it has passed straight from
// there what stops shadow rays to lamps, so that rays of delta lobes alone may find it, which see the lamp itself. With
// NO_CAUSTICS: a lobe has sent it that is left out for rays of diffuse lobes (no_caustics.glsl); no eye has sent a photon.
const int FROM_LAMP = 64;
const int IN_SHADE = 128;
const int BY_CAUSTIC = RAY_CAMERA;
const int MARKS = FROM_LAMP + IN_SHADE + BY_CAUSTIC;

struct PhotonRay {
    int rays;     // below 256, with MARKS
    int bounces;  // that are left to it
};

// Photons go as far as there is something: any distance beyond the scene will do, and says what the ray is.
float t_max_of(PhotonRay ray) { return reach_of(1 + ray.rays + 256 * ray.bounces); }

PhotonRay photon_ray(RayDirection direction) {
    int number = reach_number(direction.t_max) - 1;
#ifdef CAUSTICS
    if (came_by_lobe(direction)) number -= LOBE_BIT;
#endif
    return PhotonRay(number % 256, number / 256);
}
