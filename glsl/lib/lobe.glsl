// SPDX-License-Identifier: GPL-3.0-or-later
// Lobes besides Lambert's, whatever their kind: made/bsdf.glsl has those of the scene. Directions are unit
// vectors away from the surface; weights are f cos / pdf. A lobe of kind 0 is none, and reflects nothing.
#include "lib/colour.glsl"
#include "lib/lobe_weight.glsl"
#include "lib/sampling.glsl"
#include "lib/microfacets.glsl"
#include "made/bsdf.glsl"

// The normal of a point's lobes: the shading normal, turned towards the geometric one until the viewer's mirror
// direction is above the surface, as Cycles has it. Lambert's lobe keeps the shading normal. All unit, and on
// the viewer's side.
vec3 raised_normal(vec3 shading, vec3 geometric, vec3 to_viewer) {
    float iz = max(0.0, dot(to_viewer, geometric)), t = min(0.9 * iz, 0.01);
    vec3 mirrored = 2.0 * dot(shading, to_viewer) * shading - to_viewer;
    vec3 x = shading - dot(shading, geometric) * geometric;
    float l2 = dot(x, x);
    if (dot(mirrored, geometric) >= t || l2 < 1.0e-12) return shading;
    x *= inversesqrt(l2);
    float ix = dot(to_viewer, x);
    float a = max(1.0e-12, ix * ix + iz * iz), b = 2.0 * (a + iz * t), c = (t + iz) * (t + iz);
    float root = sqrt(max(0.0, b * b - 4.0 * a * c));
    float z2 = clamp(0.25 * (b + (ix < 0.0 ? root : -root)) / a, 0.0, 1.0);
    return sqrt(1.0 - z2) * x + sqrt(z2) * geometric;
}

bool is_lobe(Lobe lobe) { return lobe.kind > 0.0; }

// The normal of a lobe: some reflect about the shading normal itself, as Lambert's does, also where that leans away from
// the viewer; some have one of their own in its place. `raised`: the shading normal.
vec3 normal_of_lobe(Lobe lobe, Shape shape, vec3 shading, vec3 raised, vec3 geometric, vec3 to_viewer) {
    if (is_about_shading_kind(lobe.kind)) return shading;
    vec3 own = own_normal_kind(lobe, shape);
    return own == vec3(0.0) ? raised : raised_normal(own, geometric, to_viewer);
}

vec3 normal_of_lobe(Lobe lobe, Shape shape, vec3 shading, vec3 geometric, vec3 to_viewer) {
    vec3 raised = raised_normal(shading, geometric, to_viewer);
    return normal_of_lobe(lobe, shape, shading, raised, geometric, to_viewer);
}

// That of a point's lobes together, about which they gather photons; what has one of its own gathers none.
vec3 normal_of_lobes(Lobe first, Lobe second, vec3 shading, vec3 geometric, vec3 to_viewer) {
    Lobe last = is_lobe(second) ? second : first;
    bool is_raised = !(is_about_shading_kind(first.kind) && is_about_shading_kind(last.kind));
    return is_raised ? raised_normal(shading, geometric, to_viewer) : shading;
}

#ifdef TRANSPARENT
// Whether light goes straight on by it, which counts for no scattering.
bool is_transparent(Lobe lobe) { return lobe.kind == float(TRANSPARENT); }
#endif

#ifdef SCATTERING
// Whether it is a medium's, not a surface's.
bool is_phase(Lobe lobe) { return lobe.kind == float(PHASE); }
#endif

// Whether a direction that a lobe gave leads on: it is on the same side of the surface as of the lobe's normal.
bool is_onward(vec3 outgoing, vec3 geometric, vec3 normal) { return dot(outgoing, geometric) * dot(outgoing, normal) > 0.0; }

// BSDF [1/sr]; mirrors reflect no delta light.
vec3 eval_lobe(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return weight_of(shape) * eval_kind(lobe, shape, normal, to_viewer, to_light);
}

// The density of sample_lobe [1/sr]; 0 for delta lobes.
float pdf_lobe(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return pdf_kind(lobe, shape, normal, to_viewer, to_light);
}

// A direction to the light, with the density of the lobe, and what it weighs.
vec3 sample_lobe(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    vec3 to_light = sample_kind(lobe, shape, normal, to_viewer, u, weight);
    weight *= weight_of(shape);
    return to_light;
}

// By the cosine about this a lobe sends photons: diffuse ones send some where their own normal leans away from, too.
vec3 axis_of_photons(Lobe lobe, vec3 normal, vec3 geometric) {
    return is_diffuse_kind(lobe.kind) && is_about_shading_kind(lobe.kind) ? geometric : normal;
}

// The same for a photon that came from the light, and goes on to the viewer: weights are of the cosine about the axis.
// Some kinds send a share of photons by that alone.
vec3 sample_lobe_for_photon(Lobe lobe, Shape shape, vec3 normal, vec3 axis, vec3 to_light, vec2 u, out vec3 weight) {
    float by_cosine = by_cosine_kind(lobe, shape);
    bool is_by_cosine = u.x < by_cosine;
    vec2 apart = vec2((u.x - (is_by_cosine ? 0.0 : by_cosine)) / (is_by_cosine ? by_cosine : 1.0 - by_cosine), u.y);
    // One call for both cases: compilers take long for each.
    vec3 to_viewer = sample_lobe(lobe, shape, normal, to_light, apart, weight);
    if (!(by_cosine > 0.0)) {
        weight *= adjoint_kind(lobe, shape, max(0.0, dot(to_light, normal)), dot(to_viewer, normal));
        return to_viewer;
    }
    if (is_by_cosine) to_viewer = frame_about(axis) * sample_cosine_hemisphere(apart);
    float cosine = max(0.0, dot(to_viewer, axis)), density = pdf_lobe(lobe, shape, normal, to_light, to_viewer);
    density = mix(density, pdf_cosine_hemisphere(cosine), by_cosine);
    weight = vec3(0.0);
    if (density > 0.0) weight = eval_lobe(lobe, shape, normal, to_viewer, to_light) * (cosine / density);
    return to_viewer;
}

// What it reflects of the light from everywhere to a viewer at this cosine, no more than 1.
vec3 albedo_lobe(Lobe lobe, Shape shape, float cosine) {
    return weight_of(shape) * albedo_kind(lobe, shape, cosine);
}

// The probability that a point of two lobes sends its ray by the first: it goes by what they reflect.
float share_of_first(Lobe first, Shape first_shape, Lobe second, Shape second_shape, float cosine) {
    float own = mean(albedo_lobe(first, first_shape, cosine)), other = mean(albedo_lobe(second, second_shape, cosine));
    return other > 0.0 ? own / (own + other) : 1.0;
}

// The share of light that gets through it, to and fro, to what it lies over, as Cycles layers closures: by
// the viewer's direction alone, and the same for all colours unless the lobe has a tint. That is not reciprocal:
// whoever goes from the light to the eye has to ask for the direction that leads on to the eye.
vec3 transmittance_lobe(Lobe lobe, Shape shape, float cosine) {
    return transmittance_kind(lobe, shape, cosine, albedo_kind(lobe, shape, cosine));
}
