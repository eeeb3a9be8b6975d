// SPDX-License-Identifier: GPL-3.0-or-later
// Intersect each ray with the triangles: eye rays, shadow rays (ANY_HIT) and photons alike.
#include "lib/bvh.glsl"
#include "lib/hit.glsl"

void kernel() {
    RayOrigin origin = load_origin();
    RayDirection ray = load_direction();
    RayHit found = trace(origin.position, ray.direction, ray.t_max, int(origin.source));
    if (found.triangle < 0) skip();
    store_hit(Hit(found.t, stored_triangle(found.triangle), found.u, found.v));
}
