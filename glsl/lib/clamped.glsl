// SPDX-License-Identifier: GPL-3.0-or-later
// Where light of samples is CLAMPED no more of one than a limit, as Cycles has it: where the mean of the channels is above
// it all are scaled alike. Light that comes by one bounce or none is direct.
#include "lib/colour.glsl"

vec3 limited(vec3 light, bool is_direct) {
#ifdef CLAMPED
    float most = is_direct ? clamps.x : clamps.y, found = mean(abs(light));
    return found > most ? light * (most / found) : light;
#else
    return light;
#endif
}
