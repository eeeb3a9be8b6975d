// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/constants.glsl"

// Where a ray into the half space of `direction` starts: lifted off the surface.
vec3 offset_origin(vec3 position, vec3 geometric, vec3 direction) {
    float side = dot(direction, geometric) < 0.0 ? -1.0 : 1.0;
    vec3 a = abs(position);
    return position + geometric * (side * SURFACE_OFFSET * max(1.0, max(a.x, max(a.y, a.z))));
}
