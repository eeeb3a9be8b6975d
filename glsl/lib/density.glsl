// SPDX-License-Identifier: GPL-3.0-or-later
// Density estimation: how much of a photon's flux a visible point receives.
#include "lib/constants.glsl"
#include "lib/packing.glsl"

// Photons of a surface that bends away by more than 45 degrees say nothing about this point.
const float SAME_ORIENTATION = 0.7071;
// Nor do those of what lies above the point or below it, as nothing does that bends less; to what positions are
// rounded [scene units^2].
const float ROUNDED2 = 1.0e-10;
const float INNER_AREA = 0.5;  // of the disc's; error.py extrapolates with it
const float GAUSSIAN_BETA = 2.0;  // standard deviation r / 2

// The filter of radius^2 r2 at the middle of its disc [1 / area]; it integrates to one over the disc.
float filter_peak(float r2) {
#if defined(FILTER_CONSTANT)
    return 1.0 / (PI * r2);
#elif defined(FILTER_CONE)
    return 3.0 / (PI * r2);
#elif defined(FILTER_GAUSSIAN)
    return GAUSSIAN_BETA / (PI * r2 * (1.0 - exp(-GAUSSIAN_BETA)));
#else  // Epanechnikov
    return 2.0 / (PI * r2);
#endif
}

// The filter at distance^2 / radius^2 = x2 <= 1, over its peak.
float filter_shape(float x2) {
#if defined(FILTER_CONSTANT)
    return 1.0;
#elif defined(FILTER_CONE)
    return max(0.0, 1.0 - sqrt(x2));
#elif defined(FILTER_GAUSSIAN)
    return exp(-GAUSSIAN_BETA * x2);
#else  // Epanechnikov
    return max(0.0, 1.0 - x2);
#endif
}

// That of radius^2 INNER_AREA * r2, over the filter's peak. What an estimate changes by from one radius to
// the other tells its bias, which goes with the radius^2 where irradiance is smooth (Silverman 1986, sec. 4.3).
float inner_filter_shape(float x2) { return x2 > INNER_AREA ? 0.0 : filter_shape(x2 / INNER_AREA) / INNER_AREA; }

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

#if defined(FILTER_GAUSSIAN)
const int GAUSSIAN_TERMS = 12;
// The integrals of t^2 exp(-y t^2) and t^3 exp(-y t^2) from 0 to 1, for 0 <= y <= 2 to 1e-6: series.
vec2 gaussian_moments(float y) {
    vec2 sum = vec2(0.0);
    float term = 1.0;
    for (int k = 0; k < GAUSSIAN_TERMS; k++) {
        sum += term / vec2(2 * k + 3, 2 * k + 4);
        term *= -y / float(k + 1);
    }
    return sum;
}
#endif

// The integrals of the filter, times distance / radius, times its square, within x2 <= 1.
vec3 filter_moments(float x2) {
    float x = sqrt(x2);
#if defined(FILTER_CONSTANT)
    vec2 moments = vec2(2.0 / 3.0, 0.5);
#elif defined(FILTER_CONE)
    vec2 moments = vec2(2.0 - 1.5 * x, 1.5 - 1.2 * x);
#elif defined(FILTER_GAUSSIAN)
    vec2 moments = 2.0 * GAUSSIAN_BETA / (1.0 - exp(-GAUSSIAN_BETA)) * gaussian_moments(GAUSSIAN_BETA * x2);
#else  // Epanechnikov
    vec2 moments = vec2(4.0 / 3.0 - 0.8 * x2, 1.0 - 2.0 / 3.0 * x2);
#endif
    return vec3(filter_mass(x2), x * x2 * moments.x, x2 * x2 * moments.y);
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
    vec3 n = unpack_along(packed_normal);
    float cosine = dot(n, normal);
    return cosine > 0.0 && cosine * cosine >= SAME_ORIENTATION * SAME_ORIENTATION * dot(n, n);
}

// Whether a photon, so far off, is about a visible point: within the radius, of the same surface, and neither on a fold
// above the point nor on one below.
bool is_about(vec4 photon, vec3 offset, float surface, vec3 normal, float inverse_r2) {
    float d2 = dot(offset, offset), height = dot(offset, normal);
    return !(d2 * inverse_r2 > 1.0 || photon.w != surface || 2.0 * height * height > d2 + ROUNDED2);
}

// What a photon that is about a visible point, at distance^2 / radius^2 = x2, adds to the irradiance there, over the
// filter's peak: zero from the other side of a thin wall and from round a corner. In alpha the mean of what its channels
// add within the inner radius. Nothing here divides: every pair pays for it.
vec4 photon_share(vec4 flux, float x2, vec3 normal) {
    if (!same_orientation(flux.w, normal)) return vec4(0.0);
    return vec4(flux.rgb * filter_shape(x2), dot(flux.rgb, vec3(1.0 / 3.0)) * inner_filter_shape(x2));
}
