// SPDX-License-Identifier: GPL-3.0-or-later
// What visibility makes of a photon's ray where it meets a surface. How far its next ray may go says what ray that is
// (photon_ray.glsl, specular_photon.glsl). Without VISIBILITY no surface is hidden from any ray.
#include "lib/constants.glsl"
#ifdef CAUSTICS
#include "lib/specular_photon.glsl"
#endif
#ifdef VISIBILITY
#include "lib/visibility.glsl"
#include "lib/photon_ray.glsl"

// As it came; to which rays the surface is visible; which of its own go on behind the surface; and as it goes on.
struct RayAtSurface { PhotonRay came; int visible; int behind; PhotonRay next; };

RayAtSurface ray_at_surface(Place place) {
    PhotonRay came = photon_ray(load_direction());
    int visible = visibility_of(surface_number(place));
    PhotonRay scattered = PhotonRay((visible & RAYS_OF_LOBES) | (came.rays & FROM_LAMP), came.bounces - 1);
    return RayAtSurface(came, visible, came.rays & ~(visible | MARKS), scattered);
}

bool may_scatter(RayAtSurface ray) { return ray.came.bounces > 0 && (ray.visible & RAYS_OF_LOBES) != 0; }

// Whether a lobe of which rays are of these kinds may scatter light that came by the ray.
bool is_taken(RayAtSurface ray, int by) { return (ray.came.rays & (by + RAY_SHADOW + RAY_UNSHADOWED)) != 0; }

bool is_hidden(RayAtSurface ray) { return ray.behind != 0; }

// What it was it remains, of these rays: light that has only passed is direct light still.
void pass_on(inout RayAtSurface ray, int rays) {
    ray.next = PhotonRay(rays | (ray.came.rays & MARKS), ray.came.bounces);
}
void pass_behind(inout RayAtSurface ray) { pass_on(ray, ray.behind); }

float t_max_of(RayAtSurface ray) { return t_max_of(ray.next); }
#else
struct RayAtSurface { float t_max; };

RayAtSurface ray_at_surface(Place place) { return RayAtSurface(T_MAX); }
bool is_hidden(RayAtSurface ray) { return false; }
void pass_behind(RayAtSurface ray) {}
float t_max_of(RayAtSurface ray) { return ray.t_max; }
#endif

// How far the photon's next ray may go. With CAUSTICS it also says whether a lobe that is not diffuse has scattered
// the photon, now (`by_specular`) or before.
float t_max_after(RayAtSurface ray, bool by_specular) {
#ifdef CAUSTICS
    if (by_specular || came_by_lobe(load_direction())) return t_max_by_lobe(t_max_of(ray));
#endif
    return t_max_of(ray);
}
