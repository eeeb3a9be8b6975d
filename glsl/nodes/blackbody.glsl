// SPDX-License-Identifier: GPL-3.0-or-later
// The colour of a body that glows at a temperature [K], linear RGB of luminance 1 or about, >= 0, as Cycles 5.0 has it
// between 800 and 12000 K: polynomials of 1000 K over the temperature, fitted to its colours within 0.6 %.
// Operands: temperature.

vec4 run_blackbody(vec4 temperature) {
    float x = 1000.0 / clamp(temperature.x, 800.0, 12000.0);
    vec3 colour = vec3(-2.033698, 0.800584, 0.0);
    colour = colour * x + vec3(7.954147, -3.42229, 7.13648);
    colour = colour * x + vec3(-12.657697, 6.033245, -22.11528);
    colour = colour * x + vec3(9.296344, -5.154768, 24.843361);
    colour = colour * x + vec3(1.391965, 0.823661, -12.687989);
    colour = colour * x + vec3(0.651669, 0.958493, 2.472047);
    return vec4(max(colour, 0.0), 1.0);
}
