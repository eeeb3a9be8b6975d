// SPDX-License-Identifier: GPL-3.0-or-later
// Scatter or absorb each photon by Russian roulette with the shares p of its flux that Lambert's lobe and another one
// leave; a survivor's flux is multiplied by the surface's colour over p (Marino & Abbate, Reflector; Jensen 2001, sec.
// 5.2). So photons keep the mean of their channels: by the mean of the colour alone one that is red would have more
// flux after each red surface.
// That is done in scatter_diffusely (lib/photon_diffuse.glsl) and scatter_by_lobe (lib/photon_lobe.glsl).
#include "lib/offset.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/arriving_flux.glsl"
#include "lib/photon_diffuse.glsl"
#include "lib/photon_lobe.glsl"
#include "lib/photon_medium.glsl"
#include "lib/photon_roulette.glsl"
#include "lib/photon_visibility.glsl"

void kernel() {
    PhotonPoint point = photon_point();
    if (!is_place(point.place)) skip();
    Flux photon = load_flux();
    vec4 u = reflection_numbers(photon);  // x: by what it is scattered; y, z: where to
    photon.flux = arriving_flux(photon.flux);
    LobeSample by_lobe = sample_photon_lobe(point, photon.flux, u);
    RayAtSurface ray = ray_at_surface(point.place);
    Roulette chance = roulette_of(point, photon.flux, by_lobe, ray, u);
    vec3 normal = point.facing.normal;
    Leaving leaving = Leaving(photon, point.incoming, normal, false, false, false, false);
    if (scatters_diffusely(chance, u.x)) {
        scatter_diffusely(leaving, point, chance, u);
    } else if (u.x < chance.diffuse + chance.lobe) {
        scatter_by_lobe(leaving, by_lobe, point, chance.lobe, ray);
    } else if (is_hidden(ray)) {  // some rays that it stands for do not meet the surface
        pass_behind(ray);
        leaving.is_unmet = true;
        leaving.photon.flux /= 1.0 - chance.diffuse - chance.lobe;
    } else {
        skip();  // absorbed
    }
    vec3 direction = leaving.direction;
    bool leads_on = dot(direction, normal) * dot(direction, leaving.normal) > 0.0;
    if (!leads_on || !(largest(leaving.photon.flux) > 0.0)) skip();
    store_next_origin(origin_after(leaving, point, offset_origin(point.place.position, normal, direction)));
    store_next_direction(RayDirection(direction, t_max_after(ray, leaving.by_specular)));
    store_next_flux(leaving.photon);
    carry_medium(leaving);
}
