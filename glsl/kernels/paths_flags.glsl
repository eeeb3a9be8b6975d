// SPDX-License-Identifier: GPL-3.0-or-later
// One for each photon that is alive.
layout(std430, binding = 0) writeonly buffer Flags { uint flags[]; };
uniform sampler2D direction;

void main() {
    int i = thread();
    if (i >= count) return;
    ivec2 size = textureSize(direction, 0);
    bool inside = i < size.x * size.y;  // the one past the last ends up as the total
    flags[i] = inside && any(notEqual(texelFetch(direction, ivec2(i % size.x, i / size.x), 0).xyz, vec3(0.0))) ? 1u : 0u;
}
