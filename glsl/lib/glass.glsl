// SPDX-License-Identifier: GPL-3.0-or-later
// A dielectric's surface, from either side, as Cycles has it: GGX microfacets that reflect and refract (Walter et
// al. 2007), visible normals, the energy lost between microfacets given back. Unit vectors in world space; the
// viewer is above the surface, light may be below it.
//
// Radiance is divided by the squared index on its way from below, as it spreads or narrows there. The flux of a
// photon is not: see adjoint_glass. Where both eye and light are outside that cancels. Behind an open sheet they
// need not be, and Cycles leaves radiance as it is: flux is then divided by the squared index on its way below.
#include "lib/colour.glsl"
#include "lib/ggx.glsl"
#include "lib/glass_energy.glsl"

const float NO_INTERFACE = 1.0e-4;  // an index this close to 1 neither reflects nor bends

// What reflection is multiplied by.
const float REFLECTS_NOTHING = 0.0;  // Refraction BSDF
const float REFLECTS_ALL = 1.0;      // Principled BSDF
const float REFLECTS_COLOUR = 2.0;   // Glass BSDF: by the same as refraction

struct Glass {
    float reflects;    // one of the above
    bool compensated;  // "Multiscatter GGX"
    vec3 colour;       // what refraction is multiplied by, in [0, 1]
    vec3 tint;         // of the reflectance head-on
    float ior;         // of what is below over what is above, > 0
    float alpha;       // in [0, 1]; Cycles knows round microfacets alone here
    bool open;         // a sheet
};

// The last numbers of a lobe's parameters in one, of 24 bits: the tint, 7 bits a channel, and two more; below 0 it is
// that of an open sheet.
float pack_glass(vec3 tint, float reflects, float compensated, float open) {
    vec3 q = floor(clamp(tint, 0.0, 1.0) * 127.0 + 0.5);
    float switches = 2.0 * reflects + (compensated > 0.0 ? 1.0 : 0.0);
    float code = ((q.r * 128.0 + q.g) * 128.0 + q.b) * 8.0 + switches;
    return open > 0.0 ? -1.0 - code : code;
}

Glass unpack_glass(vec3 colour, float alpha, float ior, float code) {
    Glass g;
    g.open = code < 0.0;
    if (g.open) code = -1.0 - code;
    float rest = floor(code / 8.0), switches = code - 8.0 * rest;
    float red = floor(rest / 16384.0), green = floor(rest / 128.0) - 128.0 * red;
    g.reflects = floor(switches / 2.0);
    g.compensated = switches - 2.0 * g.reflects > 0.0;
    g.colour = colour;
    g.tint = vec3(red, green, rest - 16384.0 * red - 128.0 * green) / 127.0;
    g.ior = ior;
    g.alpha = alpha;
    return g;
}

// The parameters of the same lobe for who is on a side of it, 1 outside; an index is given for that.
vec3 sided_parameters(vec3 parameters, float side) {
    return vec3(parameters.x, side < 0.0 ? 1.0 / parameters.y : parameters.y, parameters.z);
}

// What radiance from below is divided by.
float spread_of(Glass g) { return g.open ? 1.0 : g.ior * g.ior; }

bool is_smooth(Glass g) { return g.alpha * g.alpha <= GGX_MIRROR || abs(g.ior - 1.0) < NO_INTERFACE; }

// What microfacets reflect and let through of light that meets them at this cosine.
void split_by_glass(Glass g, float cosine, out vec3 reflected, out vec3 refracted) {
    if (g.reflects == REFLECTS_NOTHING) {
        reflected = vec3(0.0);
        refracted = fresnel_dielectric(cosine, g.ior) < 1.0 ? g.colour : vec3(0.0);
        return;
    }
    float share = fresnel_share(cosine, g.ior);
    vec3 f = mix(f0_of_ior(g.ior) * g.tint, vec3(1.0), share);
    reflected = g.reflects == REFLECTS_COLOUR ? f * g.colour : f;
    refracted = share < 1.0 ? (1.0 - f) * g.colour : vec3(0.0);
}

// The probability with which microfacets reflect what they do not absorb.
float share_reflected(vec3 reflected, vec3 refracted) {
    float all = mean(reflected + refracted);
    return all > 0.0 ? mean(reflected) / all : 1.0;
}

// What bounces between microfacets add, per channel: a factor >= 1 by the viewer's cosine.
vec3 compensation_glass(Glass g, float viewer_cosine) {
    if (!g.compensated || is_smooth(g)) return vec3(1.0);
    float roughness = sqrt(g.alpha);
    float e = single_albedo_glass(viewer_cosine, roughness, g.ior);
    float average = single_albedo_average_glass(roughness, g.ior);
    vec3 multiple = g.colour * average / max(1.0 - g.colour * (1.0 - average), 1.0e-4);
    return 1.0 + multiple * ((1.0 - e) / e);
}

Ggx microfacets_of(Glass g) {
    return Ggx(GGX_CONSTANT, false, vec3(1.0), vec3(1.0), 1.5, vec2(g.alpha));
}

// The microfacet that leads from one direction to the other, of any length, with z > 0; zero: there is none.
vec3 microfacet_between(Glass g, vec3 v, vec3 l) {
    if (l.z > 0.0) return v + l;
    vec3 h = v + g.ior * l;
    h = h.z < 0.0 ? -h : h;
    return dot(h, v) > 0.0 && dot(h, l) < 0.0 ? h : vec3(0.0);
}

// BSDF and density [1/sr] of sample_glass; zero for smooth glass.
vec3 eval_glass(Glass g, mat3 frame, vec3 to_viewer, vec3 to_light, out float density) {
    density = 0.0;
    vec3 v = to_viewer * frame, l = to_light * frame;
    if (is_smooth(g) || v.z <= GGX_HORIZON || abs(l.z) <= GGX_HORIZON) return vec3(0.0);
    vec3 h = microfacet_between(g, v, l);
    float h2 = dot(h, h);
    if (!(h2 > 0.0)) return vec3(0.0);
    float cosine = clamp(dot(h, v) * inversesqrt(h2), 0.0, 1.0);
    vec3 reflected, refracted;
    split_by_glass(g, cosine, reflected, refracted);
    Ggx m = microfacets_of(g);
    float sv = stretched_ggx(m, v), sl = stretched_ggx(m, l), share = share_reflected(reflected, refracted);
    float normals = 2.0 * normals_density_ggx(m, h), seen = normals / (v.z + sv);
    float both = normals / (abs(l.z) * sv + v.z * sl);
    vec3 compensation = compensation_glass(g, min(1.0, v.z));
    if (l.z > 0.0) {
        density = 0.25 * share * seen;
        return 0.25 * both * reflected * compensation;
    }
    float spread = cosine * abs(dot(h, l)) * inversesqrt(h2) / h2;
    spread *= g.ior * g.ior;
    density = (1.0 - share) * seen * spread;
    return both * spread * refracted * compensation / spread_of(g);
}

// A third uniform number of the last 12 bits each of two of 24, which otherwise count for next to nothing.
float third_number(vec2 u) {
    vec2 last = mod(floor(u * 16777216.0), 4096.0);
    return (last.x * 4096.0 + last.y) * (1.0 / 16777216.0);
}

// A direction to the light on either side, with that density, and weight = f cos / pdf.
vec3 sample_glass(Glass g, mat3 frame, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 v = to_viewer * frame;
    weight = vec3(0.0);
    if (v.z <= GGX_HORIZON) return to_viewer;
    Ggx m = microfacets_of(g);
    bool smooth_glass = is_smooth(g);
    vec3 h = smooth_glass ? vec3(0.0, 0.0, 1.0) : sample_visible_normal(m, v, u);
    float along = clamp(dot(v, h), 0.0, 1.0);
    vec3 reflected, refracted;
    split_by_glass(g, along, reflected, refracted);
    float share = share_reflected(reflected, refracted);
    bool is_reflected = third_number(u) < share;
    vec3 l = is_reflected ? 2.0 * along * h - v : refract(-v, h, 1.0 / g.ior);
    if (is_reflected != (l.z > 0.0) || abs(l.z) <= GGX_HORIZON) return normalize(frame * l + 1.0e-20);
    weight = is_reflected ? reflected / share : refracted / ((1.0 - share) * spread_of(g));
    if (!smooth_glass) {
        float sv = stretched_ggx(m, v), sl = stretched_ggx(m, l), z = abs(l.z);
        weight *= (v.z + sv) * z / (z * sv + v.z * sl) * compensation_glass(g, min(1.0, v.z));
    }
    return normalize(frame * l);
}

// What it reflects and lets through in all; about that of rough glass.
vec3 albedo_glass(Glass g, float cosine) {
    vec3 reflected, refracted;
    split_by_glass(g, clamp(cosine, 0.0, 1.0), reflected, refracted);
    if (is_smooth(g) || g.reflects != REFLECTS_NOTHING) return reflected + refracted;
    return g.colour;  // where all would be reflected, some microfacets refract
}

// What sample_glass's weight is multiplied by for a photon: the viewer is where it goes, on the other side if that
// cosine is below 0, and its flux does not spread, but through a sheet.
vec3 adjoint_glass(Glass g, float from, float to) {
    vec3 given = compensation_glass(g, max(GGX_HORIZON, from));
    if (to >= 0.0) return compensation_glass(g, max(GGX_HORIZON, to)) / given;
    Glass behind = g;
    behind.ior = 1.0 / g.ior;
    return compensation_glass(behind, max(GGX_HORIZON, -to)) / given * (spread_of(g) / (g.open ? g.ior * g.ior : 1.0));
}
