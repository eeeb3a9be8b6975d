// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterise each photon's disc of influence and add its irradiance to the visible points under it
// (Marino & Abbate, Splatting). The footprint bounds the whole sphere about the photon in which visible
// points may reach it, so that splats and gather sum the same pairs on curved surfaces too.
#include "lib/table.glsl"
#include "lib/density.glsl"
#include "lib/cuts.glsl"
#include "lib/radius.glsl"

#ifdef STAGE_VERTEX
// Radii change slowly: a visible point that reaches a photon has at most 1.77 times the radius that its
// side has at the photon.
const float WIDEST = 1.78;
flat out vec4 photon;
flat out vec4 flux;

// Corners of the footprint; the photon's bounds are the square [-1, 1]^2.
vec2 footprint_corner(int vertex) {
#if defined(SHAPE_TRIANGLE)
    return vec2(vertex == 1 ? 3.0 : -1.0, vertex == 2 ? 3.0 : -1.0);
#else
    return vec2(vertex & 1, vertex >> 1) * 2.0 - 1.0;
#endif
}

void main() {
    ivec2 at = table_texel(first_photon + gl_InstanceID);
    photon = texelFetch(photon_place, at, 0);
    flux = texelFetch(photon_deposit, at, 0);
    vec3 centre = (world_to_camera * vec4(photon.xyz, 1.0)).xyz;
    float depth = -centre.z;
    float reach = largest_radius_at(photon.xyz, unpack_direction(flux.w)) * (field_is_even ? 1.0001 : WIDEST);
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // outside: clipped away
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
    vec2 scale = 2.0 / vec2(window.y - window.x, window.w - window.z);
    low = (low - window.xz) * scale - 1.0;
    high = (high - window.xz) * scale - 1.0;
    // Clipped to the screen: OpenGL drops a point whose centre lies outside, disc and all.
    low = max(low, vec2(-1.0));
    high = min(high, vec2(1.0));
    if (any(greaterThanEqual(low, high))) return;
    vec2 centre_seen = 0.5 * (low + high), half_size = 0.5 * (high - low);
    float pixels = max(half_size.x * viewport.x, half_size.y * viewport.y) + 1.0;
    // Devices limit the size of points; larger ones are drawn as quads.
    if (pixels < pixels_above || pixels > pixels_up_to) return;
#if defined(SHAPE_POINT)
    gl_Position = vec4(centre_seen, 0.0, 1.0);
    gl_PointSize = pixels;
#else
    gl_Position = vec4(centre_seen + footprint_corner(gl_VertexID) * half_size, 0.0, 1.0);
#endif
}
#endif

#ifdef STAGE_FRAGMENT
flat in vec4 photon;
flat in vec4 flux;
layout(location = 0) out vec4 irradiance;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 place = texelFetch(point_place, at, 0);
    vec3 normal = texelFetch(point_facing, at, 0).xyz;
    if (place.w == 0.0) discard;
    vec4 cuts = texelFetch(point_cuts, at, 0);
    vec3 offset = photon.xyz - place.xyz;
    if (dot(offset, cut_in_space(cuts.xy, normal)) > 1.0 || dot(offset, cut_in_space(cuts.zw, normal)) > 1.0) discard;
    float radius = texelFetch(point_reach, at, 0).x;
    float r2 = radius * radius;
    irradiance = filter_peak(r2) * photon_share(photon, flux, place.xyz, place.w, normal, 1.0 / r2);
}
#endif
