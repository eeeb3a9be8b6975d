// SPDX-License-Identifier: GPL-3.0-or-later
// Emit photons of equal flux from the lights (Marino & Abbate, Generator).
#include "lib/rng.glsl"
#include "lib/light.glsl"

// The light of a photon: systematic sampling over the photons, so each light gets its share to
// within one photon, and exactly its share in the mean over passes.
int choose_light(float u) {
    int low = 0, high = light_count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (u < light_at(middle).cdf) high = middle; else low = middle + 1;
    }
    return low;
}

void kernel() {
    int photon = element_index();
    if (photon >= photons) skip();
    vec4 shift = random4(seed, pass_index, 0xffffffffu, DIMENSION_LIGHT);
    vec4 u = random4(seed, pass_index, uint(photon), DIMENSION_LIGHT);
    Light light = light_at(choose_light((float(photon) + shift.x) / float(photons)));
    if (light.chosen <= 0.0) skip();

    vec3 local = direction_from_versine(sample_spot(light, u.x), 2.0 * PI * u.y);
    vec3 direction = frame_about(light.axis) * local;
    // A sphere of uniform radiance seen from afar is a disc: start on it, lifted to the sphere.
    vec2 disc = sample_disc(random4(seed, pass_index, uint(photon), DIMENSION_LIGHT_POINT).xy);
    vec3 lift = vec3(disc, sqrt(max(0.0, 1.0 - dot(disc, disc)))) * light.radius;
    vec3 emitted = light.power * (spot_solid_angle(light) / (4.0 * PI));

    // Lifted off a surface that the light may lie in, as all rays are that leave one.
    store_origin(RayOrigin(light.position + frame_about(direction) * lift + direction * SURFACE_OFFSET, -1.0));
    store_direction(RayDirection(direction, T_MAX));
    store_flux(Flux(emitted / (float(photons) * light.chosen), float(photon)));
}
