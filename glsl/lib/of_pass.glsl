// SPDX-License-Identifier: GPL-3.0-or-later
// What an image has of a pass of several, each of as many rows as the film.
vec4 of_pass(sampler2D image, int number) {
    return texelFetch(image, element() + ivec2(0, number * stream_size.y), 0);
}

bool counts(int bits, int number) { return (bits >> number & 1) != 0; }
