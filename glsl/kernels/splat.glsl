// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterise each photon's disc of influence and add its irradiance to the visible points under it
// (Marino & Abbate, Splatting). The footprint bounds the whole sphere about the photon in which visible
// points may reach it, so that splats and gather sum the same pairs on curved surfaces too.
#include "lib/density.glsl"
#include "lib/cuts.glsl"
#include "lib/radius.glsl"

#ifdef VERTEX
// Radii change slowly: a visible point that reaches a photon has at most 1.77 times the radius that its
// side has at the photon.
const float WIDEST = 1.78;

void vertex() {
    photon = photon_place(item());
    flux = photon_deposit(item());
    vec3 centre = (world_to_camera * vec4(photon.xyz, 1.0)).xyz;
    float depth = -centre.z;
    float reach = largest_radius_at(photon.xyz, unpack_direction(flux.w)) * (field_is_even ? 1.0001 : WIDEST);
    if (depth < -reach) return;
    vec2 low, high;  // bounds on the image plane, in window units
    if (orthographic) {
        low = centre.xy - reach;
        high = centre.xy + reach;
    } else if (depth <= reach * 1.001) {
        low = window.xz;  // the sphere reaches through the camera's plane: anywhere on the screen
        high = window.yw;
    } else {
        // Extremes of x / depth over the sphere (Mara & McGuire 2013, "2D Polyhedral Bounds of a
        // Clipped, Perspective-Projected 3D Sphere").
        float d2 = depth * depth - reach * reach;
        vec2 half_width = reach * sqrt(max(vec2(0.0), centre.xy * centre.xy + d2)) / d2;
        vec2 middle = centre.xy * depth / d2;
        low = middle - half_width;
        high = middle + half_width;
    }
    low -= spread;  // a pixel's eye ray passes its middle by
    high += spread;
    vec2 scale = 2.0 / vec2(window.y - window.x, window.w - window.z);
    cover((low - window.xz) * scale - 1.0, (high - window.xz) * scale - 1.0);
}

#else
void kernel() {
    Place place = load_place();
    if (place.surface == 0.0) skip();
    vec3 normal = load_facing().normal, offset = photon.xyz - place.position;
    Cuts cuts = load_cuts();
    bool is_cut = dot(offset, cut_in_space(cuts.first, normal)) > 1.0;
    if (is_cut || dot(offset, cut_in_space(cuts.second, normal)) > 1.0) skip();
    float radius = load_gather_radius().radius, r2 = radius * radius, inverse_r2 = 1.0 / r2;
    if (!is_about(photon, offset, place.surface, normal, inverse_r2)) skip();
    vec4 share = photon_share(flux, dot(offset, offset) * inverse_r2, normal);
    if (cuts.first != vec2(0.0)) {
        Tilt tilt = load_tilt();
        float outer = 1.0 + dot(offset, tilt_in_space(tilt.outer, normal));
        share *= vec4(vec3(outer), 1.0 + dot(offset, tilt_in_space(tilt.inner, normal)));
    }
    Coverage coverage = load_coverage();
    share *= filter_peak(r2) * vec4(vec3(coverage.scale), coverage.inner_scale);
    store_irradiance(Irradiance(share.rgb, share.a));
}
#endif
