// SPDX-License-Identifier: GPL-3.0-or-later
// The sides of surfaces by the axes that they face: +x, -x, +y, -y, +z, -z (native/src/radius/sides.rs). A surface
// counts for each axis to which its normal has a cosine of SIDE_COSINE or more: one to three of them.
const float SIDE_COSINE = 0.5;

// A side's number by its axis, 0 to 2, and the cosine to it.
int side_facing(int axis, float cosine) { return 2 * axis + (cosine < 0.0 ? 1 : 0); }
