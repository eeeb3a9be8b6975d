// SPDX-License-Identifier: GPL-3.0-or-later
// The visible point of an element, of the streams that Shade writes.
#include "lib/shadow_ray.glsl"
#ifdef WALKS
#include "lib/reach.glsl"
#endif

VisiblePoint visible_point() {
    VisiblePoint point;
    point.place = load_place();
    point.facing = load_facing();
    point.shading = load_shading();
    point.diffuse = load_diffuse();
    point.to_viewer = -load_direction().direction;
#ifdef TRANSPARENT
    point.bounces = load_chain().bounces;
    point.passed = load_chain().passed;
#else
    point.bounces = float(depth);
    point.passed = 0.0;
#endif
#ifdef WALKS
    if (is_exit(load_direction().t_max)) point.bounces -= 1.0;  // as in Cycles, a walk is no bounce
#endif
#ifdef NORMALS
    point.base = base_normal(point.place, point.facing, point.shading, point.diffuse);
#else
    point.base = point.shading.normal;
#endif
#ifdef LOBES
    Lobe other = Lobe(vec3(0.0), 0.0);
    point.lobe0 = load_lobe0();
    point.shape0 = load_shape0();
#ifdef TWO_LOBES
    point.lobe1 = other = load_lobe1();
    point.shape1 = load_shape1();
#endif
    point.raised = normal_of_lobes(point.lobe0, other, point.shading.normal, point.facing.normal, point.to_viewer);
#endif
    return point;
}
