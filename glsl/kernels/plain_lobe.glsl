// SPDX-License-Identifier: GPL-3.0-or-later
// Say what the native core needs to gather photons with Phong's lobe, if that is what a point has.
#include "lib/place.glsl"
#include "lib/gathered.glsl"

void kernel() {
    Place place = load_place();
    Lobe lobe = load_lobe0();
    Shape shape = load_shape0();
    shape = weighed(shape, gathered_share(lobe, shape));
    if (!is_place(place) || !has_weight(shape)) skip();
    vec3 to_viewer = -load_direction().direction, shading = load_shading().normal;
    vec3 normal = raised_normal(shading, load_facing().normal, to_viewer);
    vec3 mirrored = reflect(-to_viewer, normal);
    store_gathered(Gathered(normal, mean(albedo_lobe(lobe, shape, max(0.0, dot(to_viewer, shading))))));
    store_plain_lobe(PlainLobe(mirrored, shape.parameters.x));
    store_plain_peak(PlainPeak(eval_lobe(lobe, shape, normal, to_viewer, mirrored)));
}
