// SPDX-License-Identifier: GPL-3.0-or-later
// Photons under way, of which those alive have a direction.
uniform sampler2D direction;

ivec2 texel_of(int i) {
    int width = textureSize(direction, 0).x;
    return ivec2(i % width, i / width);
}

bool is_kept(int i) {
    return i < count && any(notEqual(texelFetch(direction, texel_of(i), 0).xyz, vec3(0.0)));
}
