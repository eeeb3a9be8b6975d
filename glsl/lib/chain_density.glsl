// SPDX-License-Identifier: GPL-3.0-or-later
// The density with which a lobe sent a chain's last ray [1/sr], 0 for delta lobes. With DISPERSION it is stored below 0
// once the chain has taken the colour of its wavelength (wavelength.glsl).
#ifdef SCATTERING
// Stands for that of rays which a medium has scattered: of lights that shadow rays find they bring nothing.
const float ALL_BY_SHADOW_RAYS = 1.0e38;
#endif

#ifdef DISPERSION
const float LEAST_DENSITY = 1.0e-30;  // stands for 0

bool has_colour(Throughput chain) { return chain.density < 0.0; }

float density_of(Throughput chain) {
    float density = abs(chain.density);
    return density > LEAST_DENSITY ? density : 0.0;
}

float density_with_colour(float density) { return -max(density, LEAST_DENSITY); }
#else
float density_of(Throughput chain) { return chain.density; }
#endif
