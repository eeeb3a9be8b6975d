// SPDX-License-Identifier: GPL-3.0-or-later
// Which lobes of its material a point has, and how much of them and of Lambert's what lies over them leaves. Uses
// the table of lobes.
//
// An eye ray has up to two lobes. Of a material of more, its first is one of them, and one of the others is the
// second, by chance: its weight is divided by its probability, so that passes average to all. A photon has one.
// Both have the albedo that all lobes over it leave: by the direction to the viewer, which for a photon is the one
// in which it goes on, if it does.
#include "lib/gathered.glsl"
#include "lib/diffuse.glsl"
#include "lib/rng.glsl"
#ifdef DISPERSION
#include "lib/wavelength.glsl"
#endif
#ifdef EYE
#include "lib/pixel.glsl"
#else
#include "lib/reflection.glsl"
#endif

struct Lobes { Lobe lobe0; Shape shape0; Lobe lobe1; Shape shape1; };

Lobe lobe_of(MaterialLobe l) { return Lobe(l.colour, l.kind); }

Shape shape_of(MaterialLobe l, vec3 by) {
    return Shape(pack_kind(l.kind, l.parameters, l.more), packed_weight(l.weight * by));
}

Shape shape_of(MaterialLobe l) { return shape_of(l, vec3(1.0)); }

// Element of the table of lobes, with what its material's program gives.
MaterialLobe lobe_at(int number) {
    MaterialLobe l = material_lobe_at(number);
#ifdef PROGRAMS
    l.colour = reflectance_from(l.colour_from, l.colour);
    l.covered = reflectance_from(l.covered_from, l.covered);
    l.weight = number_from(l.weight_from, l.weight);
    l.parameters = numbers_from(l.parameters_from, l.parameters);
    l.more = numbers_from(l.more_from, l.more);
#endif
    return l;
}

float choice() {
#ifdef EYE
    return random4(seed, pass_index, uint(pixel_number(load_pixel().at)), DIMENSION_SHADE + uint(depth)).x;
#else
    return random4(seed, pass_index, photon_number(load_flux()), DIMENSION_SHADE_PHOTON + uint(bounce)).x;
#endif
}

// What all that lies over a lobe lets through to a viewer at this cosine.
vec3 transmittance_above(Material material, MaterialLobe l, float cosine) {
    vec3 transmittance = vec3(1.0);
#ifdef LAYERS
    for (int i = 0; i < LAYERS && l.over > 0.0; i++) {
        l = lobe_at(int(material.first_lobe + l.over) - 1);
        transmittance *= transmittance_lobe(lobe_of(l), shape_of(l), cosine);
    }
#endif
    return transmittance;
}

// Lambert's albedo to a viewer at this cosine, and whether photons land there, whatever the cosine.
Diffuse diffuse_below(Material material, float cosine) {
    vec3 albedo = material.albedo;
    bool covers = false;
    for (int i = 0; i < int(material.lobes); i++) {
        MaterialLobe l = lobe_at(int(material.first_lobe) + i);
        if (!(largest(l.covered) > 0.0)) continue;
        covers = true;
        albedo += l.covered * transmittance_lobe(lobe_of(l), shape_of(l), cosine) * transmittance_above(material, l, cosine);
    }
    Diffuse diffuse = bare_diffuse(albedo);
    return covers ? with_photons(diffuse) : diffuse;
}

float probable_albedo(Material material, MaterialLobe l, float cosine) {
    return mean(albedo_lobe(lobe_of(l), shape_of(l, transmittance_above(material, l, cosine)), cosine)) + 1.0e-6;
}

#if defined(DIRECTIONS) && defined(GATHERED_FROM)
// Whether any lobe of a material does.
bool gathers_some(Material material) {
    float share = 0.0;
    for (int i = 0; i < int(material.lobes); i++) {
        MaterialLobe l = lobe_at(int(material.first_lobe) + i);
        share += gathered_share(lobe_of(l), shape_of(l));
    }
    return share > 0.0;
}
#endif

Lobes no_lobes() {
    Lobe none = Lobe(vec3(0.0), 0.0);
    Shape nothing = Shape(vec3(0.0), 0.0);
    return Lobes(none, nothing, none, nothing);
}

// One of a material's lobes from the first of these on, by chance, and its probability.
MaterialLobe drawn_lobe(Material material, int from, float cosine, out float probability) {
    int first = int(material.first_lobe), lobes = int(material.lobes);
    MaterialLobe l = lobe_at(first + from);
    probability = 1.0;
    if (lobes == from + 1) return l;
    float all = 0.0;
    for (int i = from; i < lobes; i++) all += probable_albedo(material, lobe_at(first + i), cosine);
    float left = choice() * all;
    for (int i = from; i < lobes; i++) {
        l = lobe_at(first + i);
        float own = probable_albedo(material, l, cosine);
        probability = own / all;
        if (left < own) break;
        left -= own;
    }
    return l;
}

// `turn`: of the tangent (tangent.glsl); `side`: of the surface.
Shape placed(Lobe lobe, Shape shape, float turn, float side) {
#ifdef DISPERSION
    if (disperses_kind(lobe.kind)) shape = weighed(shape, path_colour);
#endif
    return sided_kind(lobe, turned_kind(lobe, shape, turn), side);
}

#ifdef EYE
Lobes lobes_of(Material material, float cosine, float turn, float side) {
    Lobes found = no_lobes();
    if (!(material.lobes > 0.0)) return found;
    MaterialLobe l = lobe_at(int(material.first_lobe));
    found.lobe0 = lobe_of(l);
    found.shape0 = placed(found.lobe0, shape_of(l, transmittance_above(material, l, cosine)), turn, side);
#ifdef TWO_LOBES
    if (!(material.lobes > 1.0)) return found;
    float probability;
    l = drawn_lobe(material, 1, cosine, probability);
    found.lobe1 = lobe_of(l);
    found.shape1 = placed(found.lobe1, shape_of(l, transmittance_above(material, l, cosine) / probability), turn, side);
#endif
    return found;
}
#else
// By which layers are weighed for a photon that goes on to the eye, or for one that came through them.
float cosine_to_viewer(Facing facing, Shading shading, vec3 onward) {
    if (dot(onward, facing.normal) < 0.0) return abs(dot(onward, shading.normal));
    return max(0.0, dot(onward, raised_normal(shading.normal, facing.normal, onward)));
}

Lobes lobes_of(Material material, vec3 position, Facing facing, Shading shading, vec3 to_light, float turn) {
    Lobes found = no_lobes();
    if (!(material.lobes > 0.0)) return found;
    float probability;
    MaterialLobe l = drawn_lobe(material, 0, max(0.0, dot(to_light, shading.normal)), probability);
    found.lobe0 = lobe_of(l);
    found.shape0 = placed(found.lobe0, shape_of(l, vec3(1.0 / probability)), turn, facing.side);
#ifdef LAYERS
    if (l.over > 0.0) {
        vec4 u = reflection_numbers(load_flux());
        vec3 normal = raised_normal(shading.normal, facing.normal, to_light);
        vec3 onward = lobe_way(found.lobe0, found.shape0, position, facing, normal, to_light, u).direction;
        vec3 transmittance = transmittance_above(material, l, cosine_to_viewer(facing, shading, onward));
        found.shape0 = weighed(found.shape0, transmittance);
    }
#endif
    return found;
}
#endif
