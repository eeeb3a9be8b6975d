// SPDX-License-Identifier: GPL-3.0-or-later
// One for each deposit worth keeping: there, and finite (one NaN would poison its neighbours).
layout(std430, binding = 0) writeonly buffer Flags { uint flags[]; };
layout(std430, binding = 1) buffer Dropped { uint dropped; };  // deposits that are not finite; only grows
uniform sampler2D place;
uniform sampler2D deposit;

bool is_finite(vec4 v) { return !any(isnan(v)) && !any(isinf(v)); }

void main() {
    int i = thread();
    if (i >= count) return;
    uint keep = 0u;
    ivec2 size = textureSize(place, 0);
    if (i < size.x * size.y) {
        vec4 a = texelFetch(place, ivec2(i % size.x, i / size.x), 0);
        vec4 b = texelFetch(deposit, ivec2(i % size.x, i / size.x), 0);
        if (a.w != 0.0) {
            keep = is_finite(a) && is_finite(b) ? 1u : 0u;
            if (keep == 0u) atomicAdd(dropped, 1u);
        }
    }
    flags[i] = keep;  // the one past the last ends up as the total
}
