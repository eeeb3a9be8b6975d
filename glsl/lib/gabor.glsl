// SPDX-License-Identifier: GPL-3.0-or-later
// Gabor noise (Lagae et al. 2009) of eight impulses a cell and random signs (Tavernier et al. 2019), as a phasor
// (Tricard et al. 2019), as Cycles has it (intern/cycles/kernel/svm/gabor.h).
#include "lib/constants.glsl"
#include "lib/jenkins.glsl"

const int IMPULSES = 8;

// An impulse's wave, [cos, sin], at `squared` from it, where the wave's phase is `turns`. 0 beyond a distance of 1.
vec2 impulse(float squared, float turns) {
    if (squared >= 1.0) return vec2(0.0);
    float envelope = exp(-PI * squared) * (0.5 + 0.5 * cos(PI * squared)), angle = 2.0 * PI * turns;
    return envelope * vec2(cos(angle), sin(angle));
}

// The value in x, the phase in y, the intensity in z. `integral`: of the squared kernel.
vec4 gabor_results(vec2 phasor, float integral) {
    float most = 6.0 * sqrt(float(IMPULSES) * 0.5 * integral);
    float phase = phasor == vec2(0.0) ? 0.0 : atan(phasor.y, phasor.x);
    float value = 0.5 + 0.5 * phasor.y / most;
    return vec4(value, (phase + PI) / (2.0 * PI), length(phasor) / most, value);
}
