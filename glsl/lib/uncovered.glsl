// SPDX-License-Identifier: GPL-3.0-or-later
// Light over its coverage, of this weight: without boundary bias. LEAST_COVERAGE: as film/picture.py has it.
vec3 over_coverage(vec3 light, float coverage, float weight, vec3 of_none) {
    coverage = max(coverage, LEAST_COVERAGE * weight);
    return coverage > 0.0 ? light * weight / coverage : of_none;
}

// Mean indirect light, of a sum whose alpha is the coverage.
vec3 uncovered(vec4 indirect, float weight) {
    return over_coverage(max(indirect.rgb, 0.0), indirect.a, weight, vec3(0.0));
}
