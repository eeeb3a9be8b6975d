// SPDX-License-Identifier: GPL-3.0-or-later
// Move the flagged photons to the front of streams of the same width, in order.
layout(std430, binding = 0) readonly buffer Offsets { uint offsets[]; };
layout(rgba32f, binding = 0) writeonly uniform image2D kept_origin;
layout(rgba32f, binding = 1) writeonly uniform image2D kept_direction;
layout(rgba32f, binding = 2) writeonly uniform image2D kept_flux;
uniform sampler2D origin;
uniform sampler2D direction;
uniform sampler2D flux;

void main() {
    int i = thread();
    if (i >= count || offsets[i] == offsets[i + 1]) return;
    int width = textureSize(origin, 0).x, j = int(offsets[i]);
    ivec2 from = ivec2(i % width, i / width), to = ivec2(j % width, j / width);
    imageStore(kept_origin, to, texelFetch(origin, from, 0));
    imageStore(kept_direction, to, texelFetch(direction, from, 0));
    imageStore(kept_flux, to, texelFetch(flux, from, 0));
}
