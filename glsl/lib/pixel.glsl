// SPDX-License-Identifier: GPL-3.0-or-later
// A pixel's number in the whole frame, so that a border render draws the whole's random numbers.
// Uses the uniforms region_origin and frame_size.
int pixel(ivec2 at) {
    ivec2 p = at + region_origin;
    return p.y * frame_size.x + p.x;
}
