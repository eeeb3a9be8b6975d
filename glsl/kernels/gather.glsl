// SPDX-License-Identifier: GPL-3.0-or-later
// Add to each visible point's sum the photons around it, of a range of a grid of sorted photons.
#include "lib/density.glsl"
#include "lib/cuts.glsl"
#include "lib/radius.glsl"
#include "lib/place.glsl"

// The sum over photons within the radius, or the share of it that this lane adds up.
vec4 sum_about(Place place, vec3 normal, float radius) {
    float inverse_r2 = 1.0 / (radius * radius);
    // The margin covers the rounding of photons to cells.
    vec3 reach = vec3(radius * 1.00001 + 1.0e-7);
    ivec3 low = ivec3(floor((place.position - reach - grid_origin) / cell_size));
    ivec3 high = ivec3(floor((place.position + reach - grid_origin) / cell_size));
    low = max(low, ivec3(0));
    high = min(high, grid_cells - 1);
    Cuts cuts = load_cuts();
    vec3 first = cut_in_space(cuts.first, normal), second = cut_in_space(cuts.second, normal);
    vec4 irradiance = vec4(0.0);
    for (int z = low.z; z <= high.z; z++) {
        for (int y = low.y; y <= high.y; y++) {
            int row = (z * grid_cells.y + y) * grid_cells.x;
            if (low.x > high.x) continue;
            int end = min(int(cell_start(row + high.x + 1)), photon_range.y);
            for (int i = max(int(cell_start(row + low.x)), photon_range.x) + lane(); i < end; i += LANES) {
                vec4 photon = photon_place(i);
                vec3 offset = photon.xyz - place.position;
                float d2 = dot(offset, offset);
                if (d2 * inverse_r2 > 1.0 || dot(offset, first) > 1.0 || dot(offset, second) > 1.0) continue;
                irradiance += photon_share(photon, photon_deposit(i), place.position, place.surface, normal, inverse_r2);
            }
        }
    }
    return irradiance * filter_peak(radius * radius);
}

void kernel() {
    Place place = load_place();
    vec3 normal = load_facing().normal;
    float radius = radius_at(place.position, normal);
    vec4 irradiance = vec4(0.0);
    if (is_place(place) && radius > 0.0) irradiance = sum_about(place, normal, radius);
    irradiance = sum_over_lanes(irradiance);
    Irradiance sum = load_sum();
    store_irradiance(Irradiance(sum.irradiance + irradiance.rgb, sum.inner + irradiance.a));
}
