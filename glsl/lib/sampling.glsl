// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/constants.glsl"

// An orthonormal frame whose third column is the unit vector n.
// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
mat3 frame_about(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// The unit direction at 1 - cos(theta) = v and azimuth phi about +Z; keeps its precision as v -> 0.
vec3 direction_from_versine(float v, float phi) {
    float sine = sqrt(max(0.0, v * (2.0 - v)));
    return vec3(sine * cos(phi), sine * sin(phi), 1.0 - v);
}

// x - sin x, without cancellation, x in [0, PI].
float beyond_sine(float x) {
    float x2 = x * x;
    if (x > 0.5) return x - sin(x);
    return x * x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5040.0)));
}

// Uniform on the unit disc; pdf 1 / PI.
vec2 sample_disc(vec2 u) {
    float r = sqrt(u.x), phi = 2.0 * PI * u.y;
    return r * vec2(cos(phi), sin(phi));
}

// Density cos(theta) / PI about +Z (Malley's method).
vec3 sample_cosine_hemisphere(vec2 u) {
    vec2 d = sample_disc(u);
    return vec3(d, sqrt(max(0.0, 1.0 - dot(d, d))));
}

float pdf_cosine_hemisphere(float cosine) { return max(0.0, cosine) / PI; }

// The channel that a number draws by the shares of each, some of which are above 0.
int channel_by(vec3 shares, float u) {
    float chosen = u * (shares.r + shares.g + shares.b);
    int channel = chosen < shares.r ? 0 : chosen < shares.r + shares.g ? 1 : 2;
    if (!(shares[channel] > 0.0)) channel = shares.b > 0.0 ? 2 : shares.g > 0.0 ? 1 : 0;  // by rounding
    return channel;
}

// Whether one of several, which has its own share of all, takes the place of those before it with its share of all so far
// (Chao 1982), by one random number for all of them.
bool is_drawn(float own, inout float all, inout float u) {
    float others = all;
    all += own;
    float at = u * all;
    bool is_taken = at < own || others == 0.0;
    u = min(is_taken ? at / own : (at - own) / others, BELOW_ONE);
    return is_taken;
}
