// SPDX-License-Identifier: GPL-3.0-or-later

float mean(vec3 v) { return (v.r + v.g + v.b) * (1.0 / 3.0); }

// What a colour leaves of a flux, in the mean of its channels.
float share_left(vec3 flux, vec3 colour) { return mean(flux * colour) / max(mean(flux), 1.0e-30); }

float largest(vec3 v) { return max(v.r, max(v.g, v.b)); }

// Of linear sRGB.
float luminance(vec3 colour) { return dot(colour, vec3(0.2126, 0.7152, 0.0722)); }

// Illuminance [lx] of irradiance [W/m^2], by the luminance of sRGB's primaries and 683 lm/W.
float lux_of(vec3 irradiance) { return 683.0 * luminance(irradiance); }
