// SPDX-License-Identifier: GPL-3.0-or-later
// Where each visible point's disc ends at what stands on its surface. Beyond lies the floor under a box,
// where no photon can land, or the light on the other side of a wall. What is cut off counts neither for
// the photons nor for the coverage, so that even light stays even, whatever is cut.
//
// Two half planes: the first at the nearest point of an obstacle, so that a convex one lies beyond it as a
// whole, the second at the nearest point of what is left of others, as in corners.
#include "lib/obstacles.glsl"
#include "lib/radius.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"

void kernel() {
    Place place = load_place();
    if (!is_place(place) || !gathers(load_diffuse())) skip();
    Facing facing = load_facing();
    float radius = radius_at(place.position, facing.normal);
    if (!(radius > 0.0)) skip();
    Disc disc = disc_at(place.position, facing.normal, radius, surface_number(place));
    // One call of what looks for them: of two, compilers would make two copies.
    Cuts cuts = Cuts(vec2(0.0), vec2(0.0));
    for (bool is_first = true; ; is_first = false) {
        vec2 found = nearest_cut(disc, cuts.first);
        if (is_first) cuts.first = found;
        else cuts.second = found;
        if (!is_first || found == vec2(0.0)) break;
    }
    if (cuts.first == vec2(0.0)) skip();
    store_cuts(cuts);
}
