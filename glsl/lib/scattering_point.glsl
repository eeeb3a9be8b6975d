// SPDX-License-Identifier: GPL-3.0-or-later
// A point where a medium scatters a ray: it has the medium's phase function for a lobe, and no surface.
#include "lib/media.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/lobe.glsl"

void write_scattering_point(Hit hit, vec3 direction) {
    vec3 place = load_origin().position + hit.t * direction;
    Interior inside = interior_of(load_medium().inside, place, false);
    vec3 albedo = vec3(0.0);
#ifdef VARYING
    // Places are drawn between steps' ends, where there may be nothing.
    Interior mean = interior_of(load_medium().inside, place, true);
    for (int i = 0; i < 3; i++) {
        if (inside.extinction[i] > 0.0) continue;
        inside.extinction[i] = mean.extinction[i];
        inside.scattering[i] = mean.scattering[i];
    }
    if (inside.extinction == mean.extinction) inside.anisotropy = mean.anisotropy;
#endif
    for (int i = 0; i < 3; i++) {
        if (inside.extinction[i] > 0.0) albedo[i] = inside.scattering[i] / inside.extinction[i];
    }
    store_place(Place(place, stored_surface(IN_MEDIUM, 1.0)));
    store_facing(Facing(-direction, 1.0));
    store_shading(Shading(-direction, NO_TRIANGLE));
    store_diffuse(bare_diffuse(vec3(0.0)));
    store_lobe0(Lobe(albedo, float(PHASE)));
    store_shape0(Shape(vec3(inside.anisotropy, 0.0, 0.0), packed_weight(vec3(1.0))));
#ifdef TWO_LOBES
    store_lobe1(Lobe(vec3(0.0), 0.0));
    store_shape1(Shape(vec3(0.0), 0.0));
#endif
}
