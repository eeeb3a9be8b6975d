// SPDX-License-Identifier: GPL-3.0-or-later
// Of the mixture of a picture and of what a denoiser makes of its halves: native/src/mixture.rs on the device.

// What the denoiser makes of both halves together.
vec3 smooth_picture(vec3 clean, vec3 other_clean) { return unit * (share * clean + (1.0 - share) * other_clean); }
