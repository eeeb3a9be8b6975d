// SPDX-License-Identifier: GPL-3.0-or-later
// A lobe of GGX microfacets, as native/src/microfacets.rs evaluates it towards a viewer: D G / (4 cosines) times the
// scale times F. F leads from f0 to 1 along a dielectric's curve; where ior is 0 along Schlick's, less the dip's
// part of c (1 - c)^6.
struct Microfacets {
    vec3 scale;  // all that does not hang on the direction to the light; 0: no such lobe
    float alpha;
    vec3 f0;
    float ior;
    vec3 dip;
    float shape;  // pack_ggx_shape's second number
};

// False of what is said of lobes of other kinds.
bool is_microfacets(Microfacets m) { return m.alpha > 0.0; }
