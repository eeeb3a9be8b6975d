// SPDX-License-Identifier: GPL-3.0-or-later
// The point where a photon met a surface, of the streams that Shade writes, and how the photon leaves it.
#ifdef ARRIVALS
#include "lib/from_light.glsl"
#endif

struct PhotonPoint { Place place; Facing facing; Shading shading; Diffuse diffuse; vec3 incoming; };

PhotonPoint photon_point() {
    return PhotonPoint(load_place(), load_facing(), load_shading(), load_diffuse(), load_direction().direction);
}

struct Leaving {
    Flux photon;
    vec3 direction;
    vec3 normal;       // the direction has to be on one side of this and of the geometric one
    bool by_specular;  // a lobe that is not diffuse sent it
    bool is_unmet;     // the surface is hidden from it
    bool passes;       // a transparent surface has let it pass
    bool is_in_shade;  // of that, which lets no shadow ray of its light pass
};

// From where it goes on; what lets it through is not what it was sent by.
RayOrigin origin_after(Leaving leaving, PhotonPoint point, vec3 origin) {
#ifdef ARRIVALS
    if ((leaving.passes || leaving.is_unmet) && is_from_light(load_origin())) return passed_on(load_origin(), origin);
#endif
    return RayOrigin(origin, point.shading.triangle);
}
