// SPDX-License-Identifier: GPL-3.0-or-later
// Which lobes of its material a point has, and how much of Lambert's what lies over it leaves. Uses the
// table of lobes.
//
// An eye ray has up to two lobes, and the albedo that it sees through those that cover it. Of a material of
// more, its first is one of them, and one of the others is the second, by chance: its weight is divided by
// its probability, so that passes average to all. A photon has one lobe, which covers the albedo or not,
// for the direction in which it will leave is not known yet: of a material of several such layers one is
// chosen by chance.
#include "lib/gathered.glsl"
#include "lib/diffuse.glsl"
#include "lib/rng.glsl"
#ifdef EYE
#include "lib/pixel.glsl"
#endif

struct Lobes { Lobe lobe0; Shape shape0; Lobe lobe1; Shape shape1; };

Lobe lobe_of(MaterialLobe l) { return Lobe(l.colour, l.kind); }

Shape shape_of(MaterialLobe l, float probability) {
    return Shape(pack_kind(l.kind, l.parameters, l.more), l.weight / probability);
}

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
    return random4(seed, pass_index, uint(pixel(element())), DIMENSION_SHADE + uint(depth)).x;
#else
    return random4(seed, pass_index, uint(load_flux().photon), DIMENSION_SHADE_PHOTON + uint(bounce)).x;
#endif
}

float probable_albedo(MaterialLobe l, float cosine) {
    return mean(albedo_lobe(lobe_of(l), shape_of(l, 1.0), cosine)) + 1.0e-6;
}

#ifdef DIRECTIONS
// Whether any lobe of a material does.
bool gathers_some(Material material) {
    float share = 0.0;
    for (int i = 0; i < int(material.lobes); i++) {
        MaterialLobe l = lobe_at(int(material.first_lobe) + i);
        share += gathered_share(lobe_of(l), shape_of(l, 1.0));
    }
    return share > 0.0;
}
#endif

#ifdef EYE
Lobes lobes_of(Material material, float cosine, inout Diffuse diffuse) {
    Lobe none = Lobe(vec3(0.0), 0.0);
    Lobes found = Lobes(none, Shape(vec3(0.0), 0.0), none, Shape(vec3(0.0), 0.0));
    int first = int(material.first_lobe), lobes = int(material.lobes);
    float others = 0.0;
    vec3 albedo = diffuse.albedo;
    for (int i = 0; i < lobes; i++) {
        MaterialLobe l = lobe_at(first + i);
        if (largest(l.covered) > 0.0) albedo += l.covered * passed_by_lobe(lobe_of(l), shape_of(l, 1.0), cosine);
        if (i > 0) others += probable_albedo(l, cosine);
    }
    diffuse = bare_diffuse(albedo);
    if (lobes > 0) {
        MaterialLobe l = lobe_at(first);
        found.lobe0 = lobe_of(l);
        found.shape0 = shape_of(l, 1.0);
    }
#ifdef TWO_LOBES
    if (lobes == 2) {
        MaterialLobe l = lobe_at(first + 1);
        found.lobe1 = lobe_of(l);
        found.shape1 = shape_of(l, 1.0);
    } else if (lobes > 2) {
        float left = choice() * others;
        for (int i = 1; i < lobes; i++) {
            MaterialLobe l = lobe_at(first + i);
            float own = probable_albedo(l, cosine);
            if (left < own || i == lobes - 1) {
                found.lobe1 = lobe_of(l);
                found.shape1 = shape_of(l, own / others);
                break;
            }
            left -= own;
        }
    }
#endif
    return found;
}
#else
Lobes lobes_of(Material material, float cosine, inout Diffuse diffuse) {
    Lobe none = Lobe(vec3(0.0), 0.0);
    Lobes found = Lobes(none, Shape(vec3(0.0), 0.0), none, Shape(vec3(0.0), 0.0));
    int first = int(material.first_lobe), lobes = int(material.lobes);
    if (lobes == 0) return found;
    MaterialLobe l = lobe_at(first);
    bool is_bare = gathers(diffuse);
    if (lobes == 1 && !(is_bare && largest(l.covered) > 0.0)) {
        found.lobe0 = lobe_of(l);
        found.shape0 = shape_of(l, 1.0);
        if (!is_bare) diffuse = covered_diffuse(l.covered);
        return found;
    }
    float of_bare = mean(diffuse.albedo), all = of_bare;
    for (int i = 0; i < lobes; i++) {
        l = lobe_at(first + i);
        all += probable_albedo(l, cosine) + mean(l.covered);
        is_bare = is_bare || largest(l.covered) > 0.0;
    }
    float left = choice() * all - of_bare;
    if (left < 0.0) {
        diffuse.albedo *= all / of_bare;
        return found;
    }
    for (int i = 0; i < lobes; i++) {
        l = lobe_at(first + i);
        float own = probable_albedo(l, cosine) + mean(l.covered);
        if (left < own || i == lobes - 1) {
            found.lobe0 = lobe_of(l);
            found.shape0 = shape_of(l, own / all);
            diffuse = covered_diffuse(l.covered * (all / own));
            if (is_bare) diffuse.flags = GATHERS + IS_COVERED;  // others of its layers are, if not this
            return found;
        }
        left -= own;
    }
    return found;
}
#endif
