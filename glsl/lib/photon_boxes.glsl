// SPDX-License-Identifier: GPL-3.0-or-later
// Boxes about photons: about most of all, then about those that count for each side of surfaces. A face is
// the largest number that was met, of the coordinate where it is high and of its complement where it is low.
#include "lib/ordered.glsl"
const int BOXES = 7, FACES = 6;
layout(std430, binding = 0) buffer Boxes { uint boxes[BOXES * FACES]; };

int face_of(int box, int axis, bool is_high) { return FACES * box + (is_high ? 3 : 0) + axis; }
