// SPDX-License-Identifier: GPL-3.0-or-later
// The largest radius, and those at some of the photons.
#include "lib/packing.glsl"
uniform float radius_scale;
#include "lib/radius.glsl"
layout(std430, binding = 0) buffer Summary { uint largest; float some[]; };
uniform sampler2D place;
uniform sampler2D deposit;
uniform int samples;
uniform int step;  // photons from one to the next
uniform int first_node;
uniform int nodes;
shared uint largest_here;

void main() {
    int i = thread();
    if (gl_LocalInvocationID.x == 0u) largest_here = 0u;
    barrier();
    // Floats that are not negative are in the order of their bits.
    if (i < nodes) atomicMax(largest_here, floatBitsToUint(node_radius(first_node + i)));
    barrier();
    if (gl_LocalInvocationID.x == 0u) atomicMax(largest, largest_here);
    if (i >= samples) return;
    ivec2 texel = table_texel(i * step);
    vec3 normal = unpack_direction(texelFetch(deposit, texel, 0).w);
    some[i] = radius_at(texelFetch(place, texel, 0).xyz, normal);
}
