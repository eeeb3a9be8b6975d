// SPDX-License-Identifier: GPL-3.0-or-later
// Emit photons of equal flux from the lights (Marino & Abbate, Generator); from lights that are aimed more of
// them, each of less flux, where they count.
#include "lib/rng.glsl"
#include "lib/light_choice.glsl"
#include "lib/from_light.glsl"
#include "lib/colour.glsl"
#include "lib/photon_number.glsl"
#ifdef AIMED
#include "lib/aim.glsl"
#endif
#ifdef VISIBILITY
#include "lib/photon_ray.glsl"
#endif
#ifdef PANES
#include "lib/pane.glsl"
#endif
#ifdef PORTALS_BY_SHARE
#include "lib/emission_portals.glsl"
#endif

void kernel() {
    if (element_index() >= photons * passes) skip();
    int photon = element_index() % photons, part = element_index() / photons;
    uint own_pass = pass_index + uint(part);
    vec4 shift = random4(seed, own_pass, 0xffffffffu, DIMENSION_LIGHT);
    vec4 numbers = photon_sequence(seed, own_pass, uint(photon), uint(photons));
    // Systematic sampling over the photons, so each light gets its share to within one photon, and exactly
    // its share in the mean over passes.
    int number = choose_light((float(photon) + shift.x) / float(photons));
    Light light = light_at(number);
    if (light.chosen <= 0.0) skip();
#ifdef AIMED
    LightAim own = light_aim_at(number);
    float weight = own.root > 0.0 ? aim(int(own.root) - 1, seed, own_pass, uint(photon), numbers) : 1.0;
#endif
    LightRay emitted = emitted_by_light(light, numbers.xy, numbers.zw);
#ifdef AIMED
    if (own.root > 0.0 && number < distant_lights) emitted = about_middle(emitted, own.middle, numbers.zw);
    emitted.weight *= weight;
#endif
#ifdef PORTALS_BY_SHARE
#ifdef AIMED
    if (!(own.root > 0.0))
#endif
    emitted = through_portals(light, emitted, own_pass, uint(photon));
#endif
    vec3 flux = carried_light(light, emitted.direction) * emitted.weight;
    flux *= colour_by_nodes(light, emitted.origin, emitted.direction);
    if (!(largest(flux) > 0.0)) skip();
    // Lifted off a surface that the light may lie in, as all rays are that leave one.
    store_origin(RayOrigin(emitted.origin + emitted.direction * SURFACE_OFFSET, from_light(number)));
    float t_max = T_MAX;
#ifdef VISIBILITY
    LightLimit limit = light_limit_at(number);
    int rays = limit.shadowed > 0.0 ? RAY_SHADOW : RAY_UNSHADOWED;
#ifdef SHADED_LAMPS
    if (!is_world(light)) rays |= FROM_LAMP;
#endif
    t_max = t_max_of(PhotonRay(rays, int(limit.bounces)));
#endif
    store_direction(RayDirection(emitted.direction, t_max));
#ifdef MEDIA
    float sent = 0.0;
#ifdef PANES
    if (number < distant_lights) sent = -sent_along(emitted.direction);
#ifdef VISIBILITY
    if (!(limit.shadowed > 0.0)) sent = 0.0;  // all of it is direct light
#endif
#endif
#ifdef LIGHT_STARTS
    store_medium(Medium(light_start_at(number).inside, -1.0, sent));
#else
    store_medium(Medium(vec2(0.0), 0.0, sent));
#endif
#endif
    store_flux(Flux(flux / (float(photons) * light.chosen), held_number(photon, part)));
}
