// SPDX-License-Identifier: GPL-3.0-or-later
// Sides of surfaces are +x, -x, +y, -y, +z, -z; one counts for those to whose axis its normal has FACING.
const float FACING = 0.5;

int side_facing(int axis, float cosine) { return 2 * axis + (cosine < 0.0 ? 1 : 0); }
