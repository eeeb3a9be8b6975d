// SPDX-License-Identifier: GPL-3.0-or-later
// The deposits of a launch, of which those worth keeping are there and finite: a NaN would poison its
// neighbours.
uniform sampler2D place;
uniform sampler2D deposit;

ivec2 texel_of(int i) {
    int width = textureSize(place, 0).x;
    return ivec2(i % width, i / width);
}

bool is_finite(vec4 v) { return !any(isnan(v)) && !any(isinf(v)); }

bool has_landed(int i) { return i < count && texelFetch(place, texel_of(i), 0).w != 0.0; }

bool is_kept(int i) {
    return has_landed(i) && is_finite(texelFetch(place, texel_of(i), 0)) && is_finite(texelFetch(deposit, texel_of(i), 0));
}
