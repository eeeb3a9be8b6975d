// SPDX-License-Identifier: GPL-3.0-or-later
// GGX reflection as Cycles has it: Smith's height-correlated masking, visible normals, energy lost
// between microfacets given back (Kulla & Conty 2017). Unit vectors in world space, away from the
// surface; frame = mat3(tangent, bitangent, normal).
//
// Compensation and layer weights hang on the viewer's cosine alone, so the lobe is not reciprocal: see
// adjoint_ggx.
#include "lib/sampling.glsl"
#include "lib/fresnel.glsl"
#include "lib/ggx_energy.glsl"
#include "lib/microfacets.glsl"

const int GGX_CONSTANT = 0;    // F = f0: Glossy BSDF
const int GGX_METAL = 1;       // F82 tint (Kutz, Hasan & Edmondson 2021)
const int GGX_DIELECTRIC = 2;  // the real Fresnel curve, remapped to f0..1

// alpha_x alpha_y at or below it is a perfect mirror, as in Cycles: roughness below 0.0038.
const float GGX_MIRROR = 2.0e-10;
const float GGX_HORIZON = 1.0e-6;  // no lobe below this cosine: keeps 1 / cosine finite

struct Ggx {
    int kind;
    bool compensated;  // "Multiscatter GGX"
    vec3 f0;           // reflectance at normal incidence, in [0, 1]
    vec3 tint;         // metal: reflectance at 82 degrees over Schlick's
    float ior;         // dielectric: relative index, > 0, not 1
    vec2 alpha;        // along tangent and bitangent, in [0, 1]
};

bool is_smooth(Ggx m) { return m.alpha.x * m.alpha.y <= GGX_MIRROR; }

float roughness_ggx(Ggx m) { return sqrt(sqrt(m.alpha.x * m.alpha.y)); }

// ---- Fresnel

// Where the real curve stands between its own F0 (0) and 1 (1).
float fresnel_share(float cosine, float ior) {
    float f0 = f0_of_ior(ior);
    return clamp((fresnel_dielectric(cosine, ior) - f0) / (1.0 - f0), 0.0, 1.0);
}

// b of F = Schlick - b c (1 - c)^6 such that F(1/7) = tint * Schlick(1/7).
vec3 f82_b(vec3 f0, vec3 tint) {
    return (1.0 - tint) * (f0 + (1.0 - f0) * 0.462664366) * 17.6513847;  // (6/7)^5, 7 / (6/7)^6
}

vec3 fresnel_ggx(Ggx m, float cosine) {
    if (m.kind == GGX_CONSTANT) return m.f0;
    if (m.kind == GGX_DIELECTRIC) return m.f0 + (1.0 - m.f0) * fresnel_share(cosine, m.ior);
    float s = clamp(1.0 - cosine, 0.0, 1.0), s5 = s * s * s * s * s;
    return clamp(m.f0 + (1.0 - m.f0) * s5 - f82_b(m.f0, m.tint) * (cosine * s5 * s), 0.0, 1.0);
}

// The integral of 2 cosine F; the dielectric's by Kulla & Conty's fit.
vec3 fresnel_average_ggx(Ggx m) {
    if (m.kind == GGX_CONSTANT) return m.f0;
    if (m.kind == GGX_METAL) return m.f0 + (1.0 - m.f0) / 21.0 - f82_b(m.f0, m.tint) / 126.0;
    float n = m.ior, f0 = f0_of_ior(n);
    float average = n >= 1.0 ? (n - 1.0) / (4.08567 + 1.00071 * n)
                             : 0.997118 + n * (0.1014 - n * (0.965241 + n * 0.130607));
    return m.f0 + (1.0 - m.f0) * clamp((average - f0) / (1.0 - f0), 0.0, 1.0);
}

// ---- Energy

// What bounces between microfacets add to the lobe, per channel: a factor >= 1.
vec3 compensation_ggx(Ggx m, float viewer_cosine) {
    if (!m.compensated) return vec3(1.0);
    float roughness = roughness_ggx(m);
    float e = single_albedo_ggx(viewer_cosine, roughness);
    float average = single_albedo_average_ggx(roughness);
    vec3 f = fresnel_average_ggx(m);
    vec3 multiple = f * average / max(1.0 - f * (1.0 - average), 1.0e-4);
    return 1.0 + multiple * ((1.0 - e) / e);
}

// Cycles' estimate of the albedo seen at this cosine. Layers hang on it.
vec3 albedo_microfacets(Ggx m, float viewer_cosine) {
    float c = clamp(viewer_cosine, 0.0, 1.0), roughness = roughness_ggx(m);
    vec3 darkening = m.compensated ? compensation_ggx(m, c) * single_albedo_ggx(c, roughness) : vec3(1.0);
    float ior = m.kind == GGX_DIELECTRIC ? m.ior : 1.5;
    float smooth_cosine = smooth_cosine_ggx(c, roughness, ior);
    // Averaged over visible normals an index below 1 counts as its inverse.
    if (m.kind == GGX_DIELECTRIC) m.ior = max(m.ior, 1.0 / m.ior);
    return darkening * fresnel_ggx(m, smooth_cosine);
}

// ---- Microfacets, in the frame's coordinates

// |cosine| (1 + 2 Lambda), without its division.
float stretched_ggx(Ggx m, vec3 v) {
    vec3 s = vec3(m.alpha * v.xy, v.z);
    return sqrt(dot(s, s));
}

// D [1/sr] at the direction of h, whatever its length: no sum is normalised, so no digit is lost.
float normals_density_ggx(Ggx m, vec3 h) {
    vec3 s = vec3(h.xy / m.alpha, h.z);
    float q = dot(h, h) / max(1.0e-37, dot(s, s));
    return q * q / (PI * m.alpha.x * m.alpha.y);
}

bool beyond_horizon(vec3 v, vec3 l) { return v.z <= GGX_HORIZON || l.z <= GGX_HORIZON; }

// f [1/sr], without the cosine. Zero below the horizon and for mirrors.
vec3 eval_microfacets(Ggx m, mat3 frame, vec3 to_viewer, vec3 to_light) {
    vec3 v = to_viewer * frame, l = to_light * frame;
    if (is_smooth(m) || beyond_horizon(v, l)) return vec3(0.0);
    vec3 h = v + l;
    float f = normals_density_ggx(m, h) * 0.5 / (l.z * stretched_ggx(m, v) + v.z * stretched_ggx(m, l));
    float cosine = clamp(dot(h, v) * inversesqrt(dot(h, h)), 0.0, 1.0);
    return f * fresnel_ggx(m, cosine) * compensation_ggx(m, min(1.0, v.z));
}

// Density [1/sr] of sample_microfacets's direction to the light. A photon's is pdf_microfacets with the two exchanged.
float pdf_microfacets(Ggx m, mat3 frame, vec3 to_viewer, vec3 to_light) {
    vec3 v = to_viewer * frame, l = to_light * frame;
    if (is_smooth(m) || beyond_horizon(v, l)) return 0.0;
    return normals_density_ggx(m, v + l) * 0.5 / (v.z + stretched_ggx(m, v));
}

// A microfacet's unit normal with the density of those that v sees.
// Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
vec3 sample_visible_normal(Ggx m, vec3 v, vec2 u) {
    if (is_smooth(m)) return vec3(0.0, 0.0, 1.0);
    vec3 w = normalize(vec3(m.alpha * v.xy, v.z));
    float phi = 2.0 * PI * u.x, z = 1.0 - u.y * (1.0 + w.z);
    float sine = sqrt(max(0.0, 1.0 - z * z));
    vec3 h = vec3(sine * cos(phi), sine * sin(phi), z) + w;
    return normalize(vec3(m.alpha * h.xy, max(1.0e-7, h.z)));
}

// The other direction of a path that arrives along `from`, and f cos / pdf of one bounce. Weight zero:
// the direction is below the horizon and the path ends.
vec3 scatter_microfacets(Ggx m, mat3 frame, vec3 from, vec2 u, out vec3 weight, out float cosine) {
    vec3 v = from * frame;
    weight = vec3(0.0);
    cosine = 0.0;
    if (v.z <= GGX_HORIZON) return from;
    vec3 h = sample_visible_normal(m, v, u);
    float along = clamp(dot(v, h), 0.0, 1.0);
    vec3 l = 2.0 * along * h - v;
    cosine = min(1.0, l.z);
    if (l.z > GGX_HORIZON) {
        float sv = stretched_ggx(m, v), sl = stretched_ggx(m, l);
        weight = (v.z + sv) * l.z / (l.z * sv + v.z * sl) * fresnel_ggx(m, along);
    }
    return normalize(frame * l);
}

// A direction to the light with density pdf_microfacets, and weight = f cos / pdf.
vec3 sample_microfacets(Ggx m, mat3 frame, vec3 to_viewer, vec2 u, out vec3 weight) {
    float cosine;
    vec3 to_light = scatter_microfacets(m, frame, to_viewer, u, weight, cosine);
    weight *= compensation_ggx(m, clamp(dot(to_viewer, frame[2]), GGX_HORIZON, 1.0));
    return to_light;
}

// What f changes by when its directions change places: f(to, from) / f(from, to), by their cosines.
vec3 adjoint_ggx(Ggx m, float from, float to) {
    return compensation_ggx(m, max(GGX_HORIZON, to)) / compensation_ggx(m, max(GGX_HORIZON, from));
}

// For who evaluates it elsewhere, with numbers of pack_ggx_shape.
Microfacets microfacets_of(Ggx m, vec2 shape, vec3 normal, vec3 to_viewer) {
    vec3 scale = compensation_ggx(m, clamp(dot(to_viewer, normal), GGX_HORIZON, 1.0));
    vec3 dip = m.kind == GGX_METAL ? f82_b(m.f0, m.tint) : vec3(0.0);
    // A curve of index 1 stays at f0.
    float ior = m.kind == GGX_METAL ? 0.0 : (m.kind == GGX_DIELECTRIC ? m.ior : 1.0);
    return Microfacets(scale, shape.x, m.f0, ior, dip, shape.y);
}

// ---- The stream's three numbers

const float ASPECT_STEPS = 585.0;  // an octave
const float TURN_STEPS = 2048.0;   // half a turn

// alpha_x and alpha_y as their mean, and one number of 24 bits for the rest: log2 of how much longer one is
// than the mean (12 bits), the angle between tangent and frame (11 bits), and whether it is compensated.
vec2 pack_ggx_shape(float alpha_x, float alpha_y, float turn, float compensated) {
    float both = sqrt(alpha_x * alpha_y);
    if (alpha_x < alpha_y) turn += 0.5 * PI;  // the longer one first
    float aspect = both > 0.0 ? min(alpha_x, alpha_y) / both : 1.0;
    float steps = clamp(floor(-ASPECT_STEPS * log2(max(aspect, 1.0e-3)) + 0.5), 0.0, 4095.0);
    float turned = mod(floor(turn * (TURN_STEPS / PI) + 0.5), TURN_STEPS);
    return vec2(both, (steps * TURN_STEPS + turned) * 2.0 + (compensated > 0.0 ? 1.0 : 0.0));
}

// The same shape, its tangent turned by another angle about the normal. A round one has none.
vec2 turned_ggx_shape(vec2 shape, float angle) {
    float rest = floor(shape.y * 0.5), steps = floor(rest / TURN_STEPS);
    if (steps == 0.0) return shape;
    float turned = mod(rest + floor(angle * (TURN_STEPS / PI) + 0.5), TURN_STEPS);
    return vec2(shape.x, shape.y + 2.0 * (steps * TURN_STEPS + turned - rest));
}

// The roughness in the direction in which the lobe is sharpest.
float least_ggx_roughness(vec2 shape) {
    float steps = floor(floor(shape.y * 0.5) / TURN_STEPS);
    return sqrt(shape.x * exp2(steps * (-1.0 / ASPECT_STEPS)));
}

// The share of photons that goes by the cosine: what bounces between broad microfacets leaves towards the horizon,
// where visible normals send few photons, which would weigh the more.
float share_by_cosine(float roughness) { return 0.5 * smoothstep(0.5, 0.8, roughness); }

float share_by_cosine_ggx(vec2 shape) {
    return shape.y > 2.0 * floor(shape.y * 0.5) ? share_by_cosine(sqrt(shape.x)) : 0.0;
}

// The tint in one number, 8 bits a channel.
float pack_ggx_tint(vec3 tint) {
    vec3 q = floor(clamp(tint, 0.0, 1.0) * 255.0 + 0.5);
    return (q.r * 256.0 + q.g) * 256.0 + q.b;
}

vec3 unpack_ggx_tint(float code) {
    float red = floor(code / 65536.0), green = floor(code / 256.0) - 256.0 * red;
    return vec3(red, green, code - 65536.0 * red - 256.0 * green) / 255.0;
}

// The lobe that two numbers say, and the frame that its tangent makes about a normal.
Ggx unpack_ggx_shape(int kind, vec3 f0, vec2 shape, vec3 normal, out mat3 frame) {
    Ggx m;
    float rest = floor(shape.y * 0.5), steps = floor(rest / TURN_STEPS);
    float aspect = exp2(steps * (-1.0 / ASPECT_STEPS)), turn = (rest - steps * TURN_STEPS) * (PI / TURN_STEPS);
    m.kind = kind;
    m.compensated = shape.y > 2.0 * rest;
    m.f0 = f0;
    m.alpha = vec2(shape.x / aspect, shape.x * aspect);
    m.ior = 1.5;
    m.tint = vec3(1.0);
    frame = frame_about(normal);
    if (steps > 0.0) {
        float c = cos(turn), s = sin(turn);
        frame = mat3(c * frame[0] + s * frame[1], c * frame[1] - s * frame[0], frame[2]);
    }
    return m;
}
