// SPDX-License-Identifier: GPL-3.0-or-later
// Lobes that are broad enough to gather photons with (Hachisuka & Jensen 2009). Sharp ones send rays; between
// GATHERED_FROM and GATHERED_WHOLLY a share of the lobe does either, so that no picture jumps where one ends. What the
// eye sees itself may have a range of its own.
#include "lib/lobe.glsl"

#ifdef GATHERED_FROM
float gathered_share(Lobe lobe, Shape shape) {
    float begin = GATHERED_FROM, end = GATHERED_WHOLLY;
#ifdef SEEN_GATHERED_FROM
    if (depth == 0 && !is_diffuse_kind(lobe.kind)) {
        begin = SEEN_GATHERED_FROM;
        end = SEEN_GATHERED_WHOLLY;
    }
#endif
    return is_lobe(lobe) ? smoothstep(begin, end, roughness_kind(lobe, shape)) : 0.0;
}
#endif

// What is left of the lobe to rays.
Shape shape_of_rays(Lobe lobe, Shape shape) {
#ifdef GATHERED_LOBES
    return weighed(shape, 1.0 - gathered_share(lobe, shape));
#else
    return shape;
#endif
}
