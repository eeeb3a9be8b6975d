// SPDX-License-Identifier: GPL-3.0-or-later
// xyz: what a dielectric of an index reflects towards the viewer, polarisation averaged; w: the cosine's size. By a
// normal, or the shading normal if `given` is 0. On the back the index is the other way round.
// Operands: ior, normal, [given].
#include "lib/fresnel.glsl"

vec4 run_fresnel(vec4 ior, vec4 normal, vec4 given) {
    float cosine = dot(shading_point.to_viewer, given.x > 0.0 ? normal.xyz : shading_point.shading);
    float index = max(ior.x, 1.0e-5);
    float reflected = fresnel_dielectric(abs(cosine), shading_point.side < 0.0 ? 1.0 / index : index);
    return vec4(vec3(reflected), abs(cosine));
}
