// SPDX-License-Identifier: GPL-3.0-or-later
// Send each specular visible point's secondary ray: mirrored, or sampled in its Phong lobe.
#include "lib/rng.glsl"
#include "lib/pixel.glsl"
#include "lib/sampling.glsl"
#include "lib/offset.glsl"
#include "lib/material.glsl"

// Chains that carry less than this go on by Russian roulette.
const float ROULETTE_BELOW = 0.05;

void kernel() {
    Place place = load_place();
    if (place.surface == 0.0) skip();
    Facing facing = load_facing();
    Shading shading = load_shading();
    Material material = material_at(facing.material);
    if (largest(material.specular) <= 0.0) skip();
    vec3 incoming = load_direction().direction;
    vec4 u = random4(seed, pass_index, uint(pixel(element())), DIMENSION_MIRROR + uint(depth));
    vec3 mirrored = reflect(incoming, shading.normal);
    vec3 outgoing = material.exponent < 0.0
        ? mirrored
        : frame_about(mirrored) * sample_phong_lobe(material.exponent, u.xy);
    vec3 throughput = load_throughput().throughput * material.specular
        * specular_weight(material, dot(outgoing, shading.normal));
    float survival = min(1.0, largest(throughput) / ROULETTE_BELOW);
    if (dot(outgoing, facing.normal) <= 0.0 || u.z >= survival) skip();
    store_next_origin(RayOrigin(offset_origin(place.position, facing.normal, outgoing), shading.triangle));
    store_next_direction(RayDirection(outgoing, T_MAX));
    store_next_throughput(Throughput(throughput / survival));
}
