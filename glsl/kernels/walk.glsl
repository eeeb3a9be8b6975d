// SPDX-License-Identifier: GPL-3.0-or-later
// Follow rays that lobes send below surfaces to where they come out. Others stay as they are.
#include "lib/reach.glsl"
#include "lib/even.glsl"
#include "lib/offset.glsl"
#include "lib/random_walk.glsl"

void kernel() {
    RayOrigin origin = load_origin();
    RayDirection ray = load_direction();
    Throughput carried = load_throughput();
    Walk walk = load_walk();
    if (ray.direction == vec3(0.0)) skip();
    if (walk.goes > 0.0) {
        uint number = uint(pixel_number(load_pixel().at));
        int entered = int(origin.source);
        Exit found = walk_below(origin.position, ray.direction, carried.throughput, entered, walk.numbers, number);
        if (!(largest(found.weight) > 0.0)) skip();
        origin = RayOrigin(offset_origin(found.position, found.normal, found.normal), NO_TRIANGLE);
        ray = RayDirection(-found.normal, reach_of(EXIT));
        carried.throughput = found.weight;
    }
    store_next_direction(ray);
    store_next_origin(origin);
    store_next_throughput(carried);
}
