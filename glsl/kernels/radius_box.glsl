// SPDX-License-Identifier: GPL-3.0-or-later
// The box about most photons by a sample of them, native/src/radius/grids.rs: a work group for each face.
#include "lib/table.glsl"
#include "lib/photon_boxes.glsl"
uniform sampler2D place;
uniform int step;  // photons from one of the sample to the next
uniform int beyond;  // of the sample, on either side of each axis
shared uint sample_along[MOST_SAMPLED];
shared uint below;

void main() {
    int axis = group() % 3, own = int(gl_LocalInvocationID.x), threads = int(gl_WorkGroupSize.x);
    bool is_high = group() >= 3;
    for (int i = own; i < count; i += threads) {
        vec3 position = texelFetch(place, table_texel(i * step), 0).xyz;
        sample_along[i] = ordered(axis == 0 ? position.x : (axis == 1 ? position.y : position.z));
    }
    // Bit by bit the largest number that no more than so many are below.
    uint rank = uint(is_high ? count - 1 - beyond : beyond), found = 0u;
    for (int bit = 31; bit >= 0; bit--) {
        uint tried = found | (1u << bit), fewer = 0u;
        if (own == 0) below = 0u;
        barrier();
        for (int i = own; i < count; i += threads) fewer += sample_along[i] < tried ? 1u : 0u;
        atomicAdd(below, fewer);
        barrier();
        if (below <= rank) found = tried;
        barrier();
    }
    if (own == 0) boxes[face_of(0, axis, is_high)] = is_high ? found : ~found;
    for (int i = FACES + own; group() == 0 && i < BOXES * FACES; i += threads) boxes[i] = 0u;
}
