// SPDX-License-Identifier: GPL-3.0-or-later
// What a smooth dielectric reflects; ior is the relative index, > 0.

// Head-on.
float f0_of_ior(float ior) {
    float r = (ior - 1.0) / (ior + 1.0);
    return r * r;
}

// Unpolarised reflectance at a cosine >= 0; 1 at total reflection.
float fresnel_dielectric(float cosine, float ior) {
    float g2 = ior * ior - 1.0 + cosine * cosine;
    if (g2 <= 0.0) return 1.0;
    float g = sqrt(g2);
    float s = (g - cosine) / (g + cosine);
    float p = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0);
    return 0.5 * s * s * (1.0 + p * p);
}
