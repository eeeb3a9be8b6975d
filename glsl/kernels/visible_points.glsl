// SPDX-License-Identifier: GPL-3.0-or-later
// Where each eye ray meets a surface.
#include "lib/surface.glsl"

void kernel() {
    Hit hit = load_hit();
    if (!is_hit(hit)) skip();
    Surface surface = surface_at(hit, load_direction().direction);
    store_place(Place(surface.position, surface.surface + 1.0));
    store_facing(Facing(surface.geometric, surface.material));
    store_shading(Shading(surface.shading, float(hit_triangle(hit))));
}
