// SPDX-License-Identifier: GPL-3.0-or-later
// Indirect light of a whole coverage, without boundary bias: _over_coverage of film/picture.py, with LEAST_COVERAGE and BRIGHTER.

ivec2 in_row(int step) { return ivec2(clamp(element().x + step, 0, stream_size.x - 1), element().y); }

// Sums over a pixel and both beside it in its row; at the row's ends the last one counts twice.
vec4 row_sum(sampler2D image) {
    return texelFetch(image, in_row(-1), 0) + texelFetch(image, in_row(0), 0) + texelFetch(image, in_row(1), 0);
}

vec3 row_sum_of_light(sampler2D image) {
    vec3 before = texelFetch(image, in_row(-1), 0).rgb, behind = texelFetch(image, in_row(1), 0).rgb;
    return max(before, 0.0) + max(texelFetch(image, in_row(0), 0).rgb, 0.0) + max(behind, 0.0);
}

// By what a pixel's light is multiplied, alone or, where it is a speck, together with its row's.
struct Uncovering { float alone; float together; float row; bvec3 is_speck; };

// Of light, whose alpha is the coverage; `row`: the sum of the light in the row, and so on.
Uncovering uncovering_of(vec4 indirect, float weight, vec3 row, float covered, float weights) {
    vec3 light = max(indirect.rgb, 0.0);
    float coverage = max(indirect.a, LEAST_COVERAGE * weight), all = max(covered, LEAST_COVERAGE * weights);
    Uncovering found = Uncovering(coverage > 0.0 ? weight / coverage : 0.0, BRIGHTER, 0.0, bvec3(false));
    float missing = weight - clamp(indirect.a, 0.0, weight);
    if (all > 0.0) found.row = BRIGHTER * missing / all;
    if (missing > 0.0) found.is_speck = greaterThan(found.alone * light, found.together * light + found.row * row);
    return found;
}

vec3 uncovered(Uncovering by, vec3 light, vec3 row) {
    return mix(by.alone * light, by.together * light + by.row * row, by.is_speck);
}
