// SPDX-License-Identifier: GPL-3.0-or-later
// Sum a texture's first texels: of each work group's one sum.
layout(std430, binding = 0) writeonly buffer Sums { vec4 sums[]; };
uniform sampler2D texels;
shared vec4 shares[gl_WorkGroupSize.x];

void main() {
    uint own = gl_LocalInvocationIndex;
    int width = textureSize(texels, 0).x;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SUMMED; i += int(gl_WorkGroupSize.x)) {
        int at = group() * SUMMED + i + int(own);
        if (at < count) sum += texelFetch(texels, ivec2(at % width, at / width), 0);
    }
    shares[own] = sum;
    for (uint half_of = gl_WorkGroupSize.x / 2u; half_of > 0u; half_of /= 2u) {
        barrier();
        if (own < half_of) shares[own] += shares[own + half_of];
    }
    if (own == 0u && group() * SUMMED < count) sums[group()] = shares[0];
}
