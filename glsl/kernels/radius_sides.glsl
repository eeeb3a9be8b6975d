// SPDX-License-Identifier: GPL-3.0-or-later
// The boxes about the photons of each side, native/src/radius/grids.rs, by a sample of those in the box about most.
#include "lib/table.glsl"
#include "lib/packing.glsl"
#include "lib/sides.glsl"
#include "lib/photon_boxes.glsl"
uniform sampler2D place;
uniform sampler2D deposit;
uniform int step;  // photons from one of the sample to the next
shared uint met[BOXES * FACES];

void meet(int axis, float cosine, vec3 position) {
    if (!(abs(cosine) >= SIDE_COSINE)) return;
    int first = face_of(1 + side_facing(axis, cosine), 0, false);
    for (int k = 0; k < 3; k++) {
        uint along = ordered(position[k]);
        atomicMax(met[first + k], ~along);
        atomicMax(met[first + 3 + k], along);
    }
}

bool is_within(vec3 position) {
    vec3 low = vec3(of_ordered(~boxes[0]), of_ordered(~boxes[1]), of_ordered(~boxes[2]));
    vec3 high = vec3(of_ordered(boxes[3]), of_ordered(boxes[4]), of_ordered(boxes[5]));
    return all(greaterThanEqual(position, low)) && all(lessThanEqual(position, high));
}

void main() {
    int i = thread(), own = int(gl_LocalInvocationID.x);
    if (own < BOXES * FACES) met[own] = 0u;
    barrier();
    if (i < count) {
        ivec2 texel = table_texel(i * step);
        vec3 position = texelFetch(place, texel, 0).xyz;
        vec3 normal = unpack_direction(texelFetch(deposit, texel, 0).w);
        if (is_within(position)) {
            meet(0, normal.x, position);
            meet(1, normal.y, position);
            meet(2, normal.z, position);
        }
    }
    barrier();
    if (own >= FACES && own < BOXES * FACES) atomicMax(boxes[own], met[own]);
}
