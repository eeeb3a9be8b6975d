// SPDX-License-Identifier: GPL-3.0-or-later
// Mean indirect light, of a sum whose alpha is the coverage, of this weight: without boundary bias.
// LEAST_COVERAGE: as film/picture.py has it.
vec3 uncovered(vec4 indirect, float weight) {
    float coverage = max(indirect.a, LEAST_COVERAGE * weight);
    return coverage > 0.0 ? max(indirect.rgb, 0.0) * weight / coverage : vec3(0.0);
}
