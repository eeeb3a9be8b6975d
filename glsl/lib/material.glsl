// SPDX-License-Identifier: GPL-3.0-or-later
// BRDF = k_d / PI + k_s * (mirror, or normalised Phong lobe). Uses the table materials.
#include "lib/constants.glsl"
#include "lib/table.glsl"

struct Material {
    vec3 diffuse;    // k_d
    vec3 specular;   // k_s
    float exponent;  // of the Phong lobe; < 0: a perfect mirror
};

Material material_at(float index) {
    vec4 a = texelFetch(materials, table_texel(2 * int(index)), 0);
    vec4 b = texelFetch(materials, table_texel(2 * int(index) + 1), 0);
    return Material(a.rgb, b.rgb, a.w);
}

float mean(vec3 v) { return (v.r + v.g + v.b) * (1.0 / 3.0); }

float largest(vec3 v) { return max(v.r, max(v.g, v.b)); }

// BRDF [1/sr] for unit directions towards light and viewer; mirrors reflect no delta light.
// The lobe is Lafortune & Willems 1994's: (n + 2) / (2 PI) cos^n(alpha), reciprocal, albedo <= k_s.
vec3 eval_brdf(Material m, vec3 normal, vec3 to_light, vec3 to_viewer) {
    vec3 value = m.diffuse / PI;
    if (m.exponent >= 0.0) {
        // Not zero: pow(0, 0) is undefined, and NaN on an H200.
        float cosine = max(1.0e-30, dot(reflect(-to_light, normal), to_viewer));
        value += m.specular * ((m.exponent + 2.0) / (2.0 * PI) * pow(cosine, m.exponent));
    }
    return value;
}

// Weight of a direction sampled about the mirror direction with the lobe's density
// (pdf_phong_lobe): f cos / pdf, without k_s.
float specular_weight(Material m, float cosine) {
    return m.exponent < 0.0 ? 1.0 : (m.exponent + 2.0) / (m.exponent + 1.0) * max(0.0, cosine);
}
