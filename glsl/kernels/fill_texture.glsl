// SPDX-License-Identifier: GPL-3.0-or-later
// Set all channels of all texels: OpenGL's own way takes some GPUs far longer.
layout(rgba32f, binding = 0) writeonly uniform image2D filled;
uniform float value;

void main() {
    int width = imageSize(filled).x;
    if (thread() < count) imageStore(filled, ivec2(thread() % width, thread() / width), vec4(value));
}
