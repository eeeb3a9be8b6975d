// SPDX-License-Identifier: GPL-3.0-or-later
// What normals of nodes shade that the smooth surface about them hides, as Cycles has it (bump_shadowing_term): no
// light that comes from behind that surface; and diffuse lobes but velvet (is_softened) darken softly towards there
// (Conty Estevez, Lecocq & Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").
#include "lib/constants.glsl"

// Whether light from there is on the other side of the smooth surface, `base`.
bool leaks(vec3 base, vec3 normal, vec3 to_light) {
    return normal != base && dot(base, to_light) * dot(base, normal) * dot(normal, to_light) < 0.0;
}

// The share of light that a diffuse lobe keeps.
float bump_shadowing(vec3 base, vec3 normal, vec3 to_light) {
    if (normal == base) return 1.0;
    if (leaks(base, normal, to_light)) return 0.0;
    float light = abs(dot(base, to_light)), bent = abs(dot(base, normal));
    if (bent >= 1.0 || light >= 1.0) return 1.0;
    if (light < 1.0e-6) return 0.0;
    float alpha2 = clamp(0.125 * (1.0 / (bent * bent) - 1.0), 0.0, 1.0);
    // Smith's masking of GGX.
    return 2.0 / (1.0 + sqrt(1.0 + alpha2 * (1.0 / (light * light) - 1.0)));
}

// What Lambert's lobe about a bent normal makes of flux that fell on the triangle from there.
float bent_share(vec3 base, vec3 normal, vec3 geometric, vec3 to_light) {
    float fell = dot(to_light, geometric), cosine = max(0.0, dot(to_light, normal));
    if (fell <= 0.0) return 0.0;
    return min(cosine / fell, BRIGHTEST) * bump_shadowing(base, normal, to_light);
}
