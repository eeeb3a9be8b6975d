// SPDX-License-Identifier: GPL-3.0-or-later
const float PI = 3.14159265358979;
// Scenes are scaled into [-1, 1]^3. A point computed from its triangle's corners is off by 2 to 3
// ulp(1) = 3e-7 at most, so this lifts it off its surface and passes no wall thicker than itself.
const float SURFACE_OFFSET = 1.0e-6;
const float T_MAX = 3.0e38;
// Of points where a medium scatters light: for a surface's number, and for a triangle's; below 0 are lights'.
const float IN_MEDIUM = 8388608.0;
const float NO_TRIANGLE = 16777215.0;
const float BELOW_ONE = 0.99999994;  // the largest float32 below 1
// By how much the light that fell on a triangle is brighter about a bent normal, at most: little comes from so low.
const float BRIGHTEST = 16.0;
