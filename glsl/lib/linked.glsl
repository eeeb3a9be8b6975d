// SPDX-License-Identifier: GPL-3.0-or-later
// Which surfaces a light lights, by the sets that they are in. Uses the table of visibility.
#include "lib/light.glsl"
#include "lib/visibility.glsl"

const int LINKED_SET = 256;  // addon/photon/stage/limits.py
const int EXCLUDES = 1024;   // the first bit in a light's found_by of sets that it does not light

bool lights_surface(Light light, float surface) {
    int own = visibility_of(surface) / LINKED_SET;
    return ((int(light.found_by) / EXCLUDES >> own) & 1) == 0;
}
