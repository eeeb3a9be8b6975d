// SPDX-License-Identifier: GPL-3.0-or-later
// Add to each visible point's sum the photons around it, of a range of a grid of sorted photons.
#include "lib/table.glsl"
#include "lib/density.glsl"
#include "lib/cuts.glsl"
#include "lib/radius.glsl"

uint cell_begin(int cell) { return texelFetch(cell_start, table_texel(cell), 0).x; }

void kernel() {
    Place place = load_place();
    if (place.surface == 0.0) skip();
    vec3 normal = load_facing().normal;
    float radius = radius_at(place.position, normal);
    float r2 = radius * radius;
    // The margin covers the rounding of photons to cells.
    vec3 reach = vec3(radius * 1.00001 + 1.0e-7);
    ivec3 low = ivec3(floor((place.position - reach - grid_origin) / cell_size));
    ivec3 high = ivec3(floor((place.position + reach - grid_origin) / cell_size));
    if (any(greaterThanEqual(low, grid_cells)) || any(lessThan(high, ivec3(0)))) skip();
    low = max(low, ivec3(0));
    high = min(high, grid_cells - 1);
    Cuts cuts = load_cuts();
    vec3 first = cut_in_space(cuts.first, normal), second = cut_in_space(cuts.second, normal);
    vec4 irradiance = vec4(0.0);
    for (int z = low.z; z <= high.z; z++) {
        for (int y = low.y; y <= high.y; y++) {
            int row = (z * grid_cells.y + y) * grid_cells.x;
            int end = min(int(cell_begin(row + high.x + 1)), photon_range.y);
            for (int i = max(int(cell_begin(row + low.x)), photon_range.x); i < end; i++) {
                ivec2 at = table_texel(i);
                vec4 photon = texelFetch(photon_place, at, 0);
                vec3 offset = photon.xyz - place.position;
                if (dot(offset, offset) > r2 || dot(offset, first) > 1.0 || dot(offset, second) > 1.0) continue;
                vec4 flux = texelFetch(photon_deposit, at, 0);
                irradiance += photon_irradiance(photon, flux, place.position, place.surface, normal, r2);
            }
        }
    }
    Irradiance sum = load_sum();
    store_irradiance(Irradiance(sum.irradiance + irradiance.rgb, sum.inner + irradiance.a));
}
