// SPDX-License-Identifier: GPL-3.0-or-later
// Scatter or absorb each photon by Russian roulette with the mean albedos of Lambert's lobe and of another; a
// survivor's flux takes the surface's colour (Marino & Abbate, Reflector; Jensen 2001, sec. 5.2).
#include "lib/reflection.glsl"
#include "lib/offset.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#ifdef ARRIVALS
#include "lib/arrival.glsl"
#endif
#ifdef NORMALS
#include "lib/bump_shadowing.glsl"
#endif
#ifdef ABSORPTION
#include "lib/absorption.glsl"
#endif
#ifdef CAUSTICS
#include "lib/specular_photon.glsl"
#endif
#ifdef VISIBILITY
#include "lib/visibility.glsl"
#include "lib/photon_ray.glsl"

// Whether a lobe of which rays are of these kinds may scatter light that came by a ray.
bool is_taken(PhotonRay ray, int by) { return (ray.rays & (by + RAY_SHADOW + RAY_UNSHADOWED)) != 0; }

#ifdef LOBES
int rays_of(Lobe lobe) {
#ifdef TRANSMITS
    if (transmits_kind(lobe.kind)) return RAY_GLOSSY + RAY_TRANSMISSION;
#endif
    return RAY_GLOSSY;
}
#endif
#endif

#ifdef PORTALS
#include "lib/openings.glsl"

// Of what a diffuse surface scatters, what goes through portals at least.
const float LEAST_BY_PORTAL = 0.2;
#endif

// How far a photon's ray may go, which says what photon it is.
RayDirection sent(vec3 direction, float t_max, bool by_lobe) {
#ifdef CAUSTICS
    if (by_lobe || came_by_lobe(load_direction())) t_max = t_max_by_lobe(t_max);
#endif
    return RayDirection(direction, t_max);
}

void kernel() {
    Place place = load_place();
    if (!is_place(place)) skip();
    Facing facing = load_facing();
    Shading shading = load_shading();
    Diffuse diffuse = load_diffuse();
    Flux photon = load_flux();
    vec3 flux = photon.flux, outgoing;
#ifdef ABSORPTION
    flux *= left_by_absorption(load_hit(), facing.side, load_origin(), load_direction().direction);
#endif
    float t_max = T_MAX;
    bool by_lobe_alone = false;  // that is not diffuse
    vec4 u = reflection_numbers(photon);
    vec3 normal = facing.normal;
    float by_diffuse = mean(diffuse.albedo), by_lobe = 0.0;
#ifdef LOBES
    Lobe lobe = load_lobe0();
    Shape shape = load_shape0();
    vec3 incoming = load_direction().direction;
    vec3 weight, raised = raised_normal(shading.normal, facing.normal, -incoming);
    vec3 onward = sample_lobe_for_photon(lobe, shape, raised, -incoming, u.yz, weight);
    // Where some directions weigh much more than others, by what this one does.
    by_lobe = mean(albedo_lobe(lobe, shape, max(0.0, -dot(incoming, shading.normal))));
    by_lobe = mix(by_lobe, mean(weight), 2.0 * by_cosine_kind(lobe, shape));
    float all = max(1.0, by_diffuse + by_lobe);
    by_diffuse /= all;
    by_lobe /= all;
#endif
#ifdef VISIBILITY
    PhotonRay ray = photon_ray(load_direction());
    int visible = visibility_of(surface_number(place)), behind = ray.rays & ~visible;
    bool may_scatter = ray.bounces > 0 && (visible & RAYS_OF_LOBES) != 0;
    // What the surface does not hide goes on behind it in the cases that are left, half of all at least.
    float share = behind != 0 ? 0.5 : 1.0;
    by_diffuse *= may_scatter && is_taken(ray, RAY_DIFFUSE) ? share : 0.0;
#ifdef LOBES
    bool may_take = may_scatter && is_taken(ray, rays_of(lobe));
#ifdef TRANSPARENT
    may_take = may_take || is_transparent(lobe);
#endif
    by_lobe *= may_take ? share : 0.0;
#endif
    int onward_rays = visible & RAYS_OF_LOBES;
#endif
    bool is_diffuse = u.x < by_diffuse;
#ifdef PORTALS
    // Who would be absorbed goes through a portal instead. By the density of both ways no photon gains flux, but for
    // white surfaces'.
    float by_portal = 0.0, angles = by_diffuse > 0.0 ? portals_seen(place.position, facing.normal) : 0.0;
#ifdef VISIBILITY
    if (behind != 0) angles = 0.0;
#endif
    if (angles > 0.0) {
        float absorbed = max(0.0, 1.0 - by_diffuse - by_lobe);
        by_portal = max(absorbed, LEAST_BY_PORTAL * by_diffuse);
        by_diffuse -= by_portal - absorbed;
        is_diffuse = u.x < by_diffuse || u.x >= by_diffuse + by_lobe;
    }
#endif
    if (is_diffuse) {
        outgoing = reflect_diffusely(facing, u);
#ifdef PORTALS
        if (angles > 0.0) {
            float which = clamp((u.x - by_diffuse - by_lobe) / by_portal, 0.0, 0.99999994);
            if (u.x >= by_diffuse) outgoing = sample_portals(place.position, facing.normal, angles, vec2(which, u.y));
            float by_cosine = pdf_cosine_hemisphere(dot(outgoing, facing.normal));
            float density = by_portal * pdf_portals(place.position, facing.normal, angles, outgoing);
            flux *= diffuse.albedo * by_cosine / max(by_diffuse * by_cosine + density, 1.0e-30);
        } else
#endif
        flux *= diffuse.albedo / by_diffuse;
#ifdef NORMALS
        vec3 base = is_displaced(diffuse) ? base_of(diffuse, shading.normal) : facing.normal;
        flux *= bent_share(base, shading.normal, facing.normal, -load_direction().direction);
#endif
#ifdef ARRIVALS
        flux *= share_of_arrival(load_origin(), place.position, BY_DIFFUSE);
#endif
#ifdef LOBES
    } else if (u.x < by_diffuse + by_lobe) {
        normal = raised;
        outgoing = onward;
        by_lobe_alone = !is_diffuse_kind(lobe.kind);
#ifdef NO_CAUSTICS
        // Cycles leaves the lobe out where a diffuse ray meets it: such a ray cannot have found the photon.
        int caustic = dot(outgoing, facing.normal) < 0.0 ? REFRACTIVE_CAUSTICS : REFLECTIVE_CAUSTICS;
        if ((NO_CAUSTICS & caustic) != 0 && !is_diffuse_kind(lobe.kind)) onward_rays &= ~RAY_DIFFUSE;
#endif
        flux *= weight / by_lobe;
#ifdef DISPERSION
        if (disperses_kind(lobe.kind)) photon = with_colour(photon);
#endif
#ifdef TRANSPARENT
        if (is_transparent(lobe)) {
            // What it was it remains: light that has only passed is direct light still.
            store_next_origin(RayOrigin(offset_origin(place.position, facing.normal, outgoing), shading.triangle));
            store_next_direction(sent(outgoing, t_max_of(PhotonRay(ray.rays & visible, ray.bounces)), false));
            store_next_flux(Flux(flux, photon.photon));
            return;
        }
#endif
        // What flux that fell on the triangle is on the lobe, and leaves it (Veach 1997, sec. 5.3.2).
        float falls = dot(incoming, normal) / dot(incoming, facing.normal);
        flux *= clamp(falls * dot(outgoing, facing.normal) / dot(outgoing, normal), 0.0, BRIGHTEST);
#ifdef TRANSMITS
#ifdef VISIBILITY
        if (!is_taken(ray, dot(outgoing, facing.normal) < 0.0 ? RAY_TRANSMISSION : RAY_GLOSSY)) skip();
#endif
#endif
#ifdef ARRIVALS
        flux *= share_of_arrival(load_origin(), place.position, BY_GLOSSY);
#endif
#endif
#ifdef VISIBILITY
    } else if (behind != 0) {
        vec3 through = load_direction().direction;
        store_next_origin(RayOrigin(offset_origin(place.position, facing.normal, through), shading.triangle));
        store_next_direction(sent(through, t_max_of(PhotonRay(behind, ray.bounces)), false));
        store_next_flux(Flux(flux / (1.0 - by_diffuse - by_lobe), photon.photon));
        return;
#endif
    } else {
        skip();
    }
#ifdef VISIBILITY
    t_max = t_max_of(PhotonRay(onward_rays, ray.bounces - 1));
#endif
    if (!(dot(outgoing, facing.normal) * dot(outgoing, normal) > 0.0) || !(largest(flux) > 0.0)) skip();
    store_next_origin(RayOrigin(offset_origin(place.position, facing.normal, outgoing), shading.triangle));
    store_next_direction(sent(outgoing, t_max, by_lobe_alone));
    store_next_flux(Flux(flux, photon.photon));
}
