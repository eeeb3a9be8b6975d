// SPDX-License-Identifier: GPL-3.0-or-later
// With SAMPLE a direction and its weight for two uniform numbers, with PHOTON those of a photon; else BSDF and
// density, and albedo, or with PASSED what gets through.
#include "lib/lobe.glsl"

void kernel() {
    Lobe lobe = Lobe(colour, kind);
    Shape shape = Shape(pack_kind(kind, parameters, more), packed_weight(vec3(1.0)));
    vec3 normal = vec3(0.0, 0.0, 1.0);
    vec3 to_viewer = load_viewer().value.xyz, other = load_other().value.xyz;
#ifdef SAMPLE
    vec3 weight, to_light;
#ifdef PHOTON
    to_light = sample_lobe_for_photon(lobe, shape, normal, normal, to_viewer, other.xy, weight);
#else
    to_light = sample_lobe(lobe, shape, normal, to_viewer, other.xy, weight);
#endif
    store_first(Value(vec4(to_light, 1.0)));
    store_second(Value(vec4(weight, 1.0)));
#else
    float pdf = pdf_kind(lobe, shape, normal, to_viewer, other);
    float cosine = max(0.0, to_viewer.z);
    store_first(Value(vec4(eval_lobe(lobe, shape, normal, to_viewer, other), pdf)));
#ifdef PASSED
    store_second(Value(vec4(transmittance_lobe(lobe, shape, cosine), 1.0)));
#else
    store_second(Value(vec4(albedo_lobe(lobe, shape, cosine), 1.0)));
#endif
#endif
}
