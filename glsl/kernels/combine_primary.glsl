// SPDX-License-Identifier: GPL-3.0-or-later
// What the eye sees directly: direct, indirect, emitters and background.
#include "lib/hit.glsl"
#include "lib/constants.glsl"
#include "lib/colour.glsl"
#include "lib/diffuse.glsl"
#ifdef PHOTON_MAP
#include "lib/blur.glsl"
#endif
#include "lib/clamped.glsl"
#ifdef MIST
#include "lib/mist.glsl"
#endif

void kernel() {
    bool seen = is_hit(load_hit());
    vec3 diffuse = load_diffuse().albedo, throughput = vec3(1.0);
#ifdef MEDIA
    throughput = load_throughput().throughput;
#endif
    // The alphas of direct and indirect carry the surface's weight without and with its coverage:
    // the film divides mean by mean, for the mean of quotients would be biased.
    float weight = seen ? mean(throughput * diffuse) : 0.0;
    float coverage = load_coverage().share;
    vec3 direct = seen ? throughput * load_direct().radiance : vec3(0.0);
    vec3 indirect = seen ? diffuse / PI * load_irradiance().irradiance : vec3(0.0);
#ifdef GATHERED_LOBES
    if (seen) indirect += load_gloss().radiance;
    if (seen) weight += mean(throughput) * load_gathered().albedo;
#endif
    store_direct_seen(Radiance(limited(direct, true), weight));
    store_indirect_seen(Radiance(throughput * indirect, weight * coverage));
#ifdef PHOTON_MAP
    store_blur_seen(blur_of(throughput));
#endif
    bool held_out = false;
#ifdef VISIBILITY
    held_out = seen && is_holdout(load_diffuse());
#endif
    vec3 background = vec3(0.0);
#ifdef EMITTERS
    store_emission_seen(Radiance(held_out ? vec3(0.0) : limited(load_emitted().radiance, true), 1.0));
    background = limited(load_environment().radiance, true) * background_alpha;
#endif
    float alpha = held_out ? let_through_by(load_diffuse()) : (seen ? 1.0 : background_alpha);
#ifdef MEDIA
    // What media take of what is behind them they hide, whatever it weighs that they scatter a share of all rays alone.
    if (!is_scattered(load_hit())) alpha = 1.0 - mean(throughput) * (1.0 - alpha);
#endif
#ifdef ILLUMINANCE
    float there = seen && is_diffuse(load_diffuse()) ? 1.0 : 0.0;
    float by_photons = there * lux_of(load_irradiance().irradiance);
    store_illuminance_seen(IlluminanceSeen(there * load_illuminance().lux, by_photons, there, there * coverage));
#endif
    // The normal's alpha carries the depth along the view axis.
    vec3 place = load_place().position, normal = load_shading().normal;
    bool ends = seen;
#ifdef SCATTERING
    if (is_scattered(load_hit())) {  // which depth knows nothing of, nor normals
        ends = is_hit(load_end());
        place = load_origin().position + load_end().t * load_direction().direction;
        normal = vec3(0.0);
    }
#endif
    float depth = dot(place - eye, view_axis);
#ifdef PANORAMIC
    if (load_direction().direction == vec3(0.0)) alpha = 1.0;  // black, as Cycles leaves it
    depth = distance(place, eye);
#endif
    store_background_seen(Radiance(background, alpha));
#ifdef MIST
    bool tells = seen && !is_scattered(load_hit());
#ifdef VISIBILITY
    tells = tells && !(held_out && let_through_by(load_diffuse()) == 0.0);
#endif
    store_mist_seen(Radiance(vec3(0.0), tells ? mean(throughput) * nearness_of(place) : 0.0));
#endif
    store_normal_seen(Radiance(ends ? normal : vec3(0.0), ends ? depth : 0.0));
}
