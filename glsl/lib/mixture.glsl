// SPDX-License-Identifier: GPL-3.0-or-later
// Of the mixture of a picture and of what a denoiser makes of its halves: native/src/mixture.rs on the device.

// What both halves have beyond this, in units of what is 1 to the denoiser, is a lamp, not noise, and is kept from the
// denoiser, which would let it shine on its neighbours.
const float BRIGHTEST = 16.0;
const float MOST = 3.4e38;

// Both halves in units of a light, and what they have beyond the brightest that is given. Of one pass, which is its
// own half, nothing tells lamps.
struct Lights { vec3 first; vec3 other; vec3 beyond; };

Lights lights_of(vec3 picture, vec3 first) {
    bool halved = share < 1.0;
    vec3 other = halved ? (picture - share * first) / (1.0 - share) : first;
    first = max(first, vec3(0.0)) / unit;
    other = max(other, vec3(0.0)) / unit;
    return Lights(first, other, halved ? clamp(min(first, other) - BRIGHTEST, vec3(0.0), vec3(MOST)) : vec3(0.0));
}

// What the denoiser makes of both halves together.
vec3 smooth_picture(vec3 clean, vec3 other_clean, vec3 beyond) {
    return unit * (share * clean + (1.0 - share) * other_clean + beyond);
}
