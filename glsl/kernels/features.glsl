// SPDX-License-Identifier: GPL-3.0-or-later
// What denoisers go by: albedo and normal of what a ray shows. What is a mirror or clear glass for the most part
// shows what is behind it, tinted: its alpha of 0 says that the ray goes on.
#include "lib/hit.glsl"
#include "lib/colour.glsl"
#ifdef LOBES
#include "lib/lobe.glsl"
#endif

// Lobes of a smaller roughness show pictures (of the microfacets' alpha this is 0.075, where Cycles ends them, too).
const float MIRRORS_BELOW = 0.27;
// Of what reflects, the share of such lobes from which on a surface counts as a mirror.
const float MIRROR_SHARE = 0.75;

void kernel() {
    vec3 throughput = load_throughput().throughput, albedo = vec3(0.0), normal = vec3(0.0);
    float mirrored = 0.0;
    if (is_hit(load_hit())) {
        albedo = load_diffuse().albedo;
        normal = load_shading().normal;
#ifdef LOBES
        float cosine = max(0.0, -dot(load_direction().direction, normal));
        Lobe lobe = load_lobe0();
        Shape shape = load_shape0();
        vec3 reflected = is_lobe(lobe) ? albedo_lobe(lobe, shape, cosine) : vec3(0.0);
        bool is_mirror = roughness_kind(lobe, shape) < MIRRORS_BELOW && !is_diffuse_kind(lobe.kind);
#ifdef SCATTERING
        is_mirror = is_mirror && !is_phase(lobe);
#endif
        if (is_mirror) mirrored += mean(reflected); else albedo += reflected;
#ifdef TWO_LOBES
        lobe = load_lobe1();
        shape = load_shape1();
        reflected = is_lobe(lobe) ? albedo_lobe(lobe, shape, cosine) : vec3(0.0);
        is_mirror = roughness_kind(lobe, shape) < MIRRORS_BELOW && !is_diffuse_kind(lobe.kind);
        if (is_mirror) mirrored += mean(reflected); else albedo += reflected;
#endif
#endif
    }
    float all = mean(albedo) + mirrored;
    albedo *= throughput;
#ifdef EMITTERS
    // What surfaces emit has no noise of its own, but edges.
#ifdef MEDIA
    throughput = load_arriving().throughput;
#endif
    albedo += throughput * (load_emitted().radiance + load_environment().radiance);
#endif
    store_albedo_seen(Radiance(clamp(albedo, 0.0, 1.0), 1.0));
    store_normal_seen(Radiance(normal, mirrored > MIRROR_SHARE * all ? 0.0 : 1.0));
}
