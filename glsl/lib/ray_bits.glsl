// SPDX-License-Identifier: GPL-3.0-or-later
// Rays by what sent them, a bit each (addon/photon/scene/visibility.py).

const int RAY_CAMERA = 1;
const int RAY_DIFFUSE = 2;
const int RAY_GLOSSY = 4;
const int RAY_TRANSMISSION = 8;
const int RAY_SHADOW = 16;
const int RAY_UNSHADOWED = 32;  // to a light that casts no shadow: no surface is visible to it
const int RAYS_OF_LOBES = RAY_DIFFUSE + RAY_GLOSSY + RAY_TRANSMISSION;
const int ALL_RAYS = RAY_CAMERA + RAYS_OF_LOBES + RAY_SHADOW + RAY_UNSHADOWED;

// By how a lobe sends light, a bit each.
const int REFLECTIVE_CAUSTICS = 1;
const int REFRACTIVE_CAUSTICS = 2;
