// SPDX-License-Identifier: GPL-3.0-or-later
// Density estimation: how much of a photon's flux a visible point receives.
#include "lib/constants.glsl"
#include "lib/packing.glsl"

// Photons of a surface that bends away by more than 45 degrees say nothing about this point.
const float SAME_ORIENTATION = 0.7071;
const float INNER_AREA = 0.5;  // of the disc's; error.py extrapolates with it
const float GAUSSIAN_BETA = 2.0;  // standard deviation r / 2

// Filter of radius^2 r2 at distance^2 d2 [1 / area]; integrates to one over the disc.
float eval_filter(float d2, float r2) {
    float x2 = d2 / r2;
#if defined(FILTER_CONSTANT)
    return 1.0 / (PI * r2);
#elif defined(FILTER_CONE)
    return 3.0 / (PI * r2) * max(0.0, 1.0 - sqrt(x2));
#elif defined(FILTER_GAUSSIAN)
    return GAUSSIAN_BETA / (PI * r2 * (1.0 - exp(-GAUSSIAN_BETA))) * exp(-GAUSSIAN_BETA * x2);
#else  // Epanechnikov
    return 2.0 / (PI * r2) * max(0.0, 1.0 - x2);
#endif
}

// The same filter of radius^2 INNER_AREA * r2. What an estimate changes by from one radius to the other
// tells its bias, which goes with the radius^2 where irradiance is smooth (Silverman 1986, sec. 4.3).
float eval_inner_filter(float d2, float r2) {
    float inner = INNER_AREA * r2;
    return d2 > inner ? 0.0 : eval_filter(d2, inner);
}

// The share of the filter's mass within distance^2 / radius^2 = x2 <= 1.
float filter_mass(float x2) {
#if defined(FILTER_CONSTANT)
    return x2;
#elif defined(FILTER_CONE)
    return x2 * (3.0 - 2.0 * sqrt(x2));
#elif defined(FILTER_GAUSSIAN)
    return (1.0 - exp(-GAUSSIAN_BETA * x2)) / (1.0 - exp(-GAUSSIAN_BETA));
#else  // Epanechnikov
    return x2 * (2.0 - x2);
#endif
}

// Distance^2 / radius^2 in [0, 1] distributed as the filter's mass over the disc.
float sample_filter(float u) {
#if defined(FILTER_CONSTANT)
    return u;
#elif defined(FILTER_CONE)
    float x = 0.5 - sin(asin(1.0 - 2.0 * u) / 3.0);  // solves 3 x^2 - 2 x^3 = u
    return x * x;
#elif defined(FILTER_GAUSSIAN)
    return -log(1.0 - u * (1.0 - exp(-GAUSSIAN_BETA))) / GAUSSIAN_BETA;
#else  // Epanechnikov: 2 s - s^2 = u
    return 1.0 - sqrt(1.0 - u);
#endif
}

// Whether photons that fell on a surface of this normal count for a visible point of that one. Asked of
// the normal as photons carry it, packed, so that the photons and the coverage agree at 45 degrees too.
bool same_orientation(float packed_normal, vec3 normal) {
    return dot(unpack_direction(packed_normal), normal) >= SAME_ORIENTATION;
}

// Irradiance that a photon adds at a visible point: zero beyond the radius, from another surface,
// from the other side of a thin wall, or from round a corner. In alpha the mean of what its channels
// add within the inner radius.
vec4 photon_irradiance(vec4 photon, vec4 flux, vec3 position, float surface, vec3 normal, float r2) {
    vec3 offset = photon.xyz - position;
    float d2 = dot(offset, offset);
    if (d2 > r2 || photon.w != surface) return vec4(0.0);
    if (!same_orientation(flux.w, normal)) return vec4(0.0);
    return vec4(flux.rgb * eval_filter(d2, r2), dot(flux.rgb, vec3(1.0 / 3.0)) * eval_inner_filter(d2, r2));
}
