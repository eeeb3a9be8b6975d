// SPDX-License-Identifier: GPL-3.0-or-later
// What a coat's tint, as it is seen head-on, leaves of what is below: light is absorbed on its way through the coat,
// once for the ray to the viewer, which is refracted.

vec3 transmittance_of_tint(vec3 tint, float ior, float cover, float cosine) {
    ior = max(ior, 1.0);
    float inside = sqrt(max(1.0e-6, 1.0 - (1.0 - cosine * cosine) / (ior * ior)));
    return max(mix(vec3(1.0), pow(max(tint, vec3(0.0)), vec3(1.0 / inside)), cover), vec3(0.0));
}
