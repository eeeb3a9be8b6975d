// SPDX-License-Identifier: GPL-3.0-or-later
// Move the photons that are alive to the front of streams of the same width and fewer rows, in order; what
// they leave there is no photon.
#include "lib/compaction.glsl"
#include "lib/under_way.glsl"
layout(rgba32f, binding = 0) writeonly uniform image2D kept_origin;
layout(rgba32f, binding = 1) writeonly uniform image2D kept_direction;
layout(rgba32f, binding = 2) writeonly uniform image2D kept_flux;
uniform sampler2D origin;
uniform sampler2D flux;
#ifdef MEDIA
layout(rgba32f, binding = 3) writeonly uniform image2D kept_medium;
uniform sampler2D medium;
#endif

void main() {
    int kept = int(kept_in_all()), to = int(kept_before_here());
    for (int i = first_element(); i < first_element() + PER_THREAD; i++) {
        if (i >= kept && texel_of(i).y < imageSize(kept_origin).y) {
            imageStore(kept_origin, texel_of(i), vec4(0.0));
            imageStore(kept_direction, texel_of(i), vec4(0.0));
            imageStore(kept_flux, texel_of(i), vec4(0.0));
#ifdef MEDIA
            imageStore(kept_medium, texel_of(i), vec4(0.0));
#endif
        }
        if (!is_kept(i)) continue;
        ivec2 from = texel_of(i), there = texel_of(to);
        imageStore(kept_origin, there, texelFetch(origin, from, 0));
        imageStore(kept_direction, there, texelFetch(direction, from, 0));
        imageStore(kept_flux, there, texelFetch(flux, from, 0));
#ifdef MEDIA
        imageStore(kept_medium, there, texelFetch(medium, from, 0));
#endif
        to++;
    }
}
