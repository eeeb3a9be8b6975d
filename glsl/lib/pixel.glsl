// SPDX-License-Identifier: GPL-3.0-or-later
// A pixel's number in the whole frame, so that a border render draws the whole's random numbers.
// Uses the uniform frame_size.
int pixel_number(vec2 at) { return int(at.y) * frame_size.x + int(at.x); }
