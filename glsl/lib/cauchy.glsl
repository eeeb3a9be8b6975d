// SPDX-License-Identifier: GPL-3.0-or-later
// The index of what disperses light, at the wavelength of a path: Cauchy's formula n = A + B / wavelength^2, by the
// index at Fraunhofer's line d and the Abbe number (n_d - 1) / (n_F - n_C).
const float LINE_D = 0.58756, LINE_F = 0.48613, LINE_C = 0.65627;  // [um]

// (n - n_d) / (n_F - n_C) there; 0: the path is of all wavelengths, and the index that of d. Shade sets it.
float cauchy = 0.0;

float cauchy_at(float wavelength) {
    float lines = 1.0 / (LINE_F * LINE_F) - 1.0 / (LINE_C * LINE_C);
    return (1.0 / (wavelength * wavelength) - 1.0 / (LINE_D * LINE_D)) / lines;
}

// An index at the path's wavelength; dispersion: 1 / Abbe number, of the denser of both sides.
float dispersed(float ior, float dispersion) {
    float denser = max(ior, 1.0 / ior);
    denser += (denser - 1.0) * dispersion * cauchy;
    return ior < 1.0 ? 1.0 / denser : denser;
}
