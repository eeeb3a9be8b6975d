// SPDX-License-Identifier: GPL-3.0-or-later
// Which lobes of its material a point has, and how much of them and of Lambert's what lies over them leaves. Uses
// the table of lobes.
//
// An eye ray has up to two lobes. Of a material of more, its first is one of them, and one of the others is the
// second, by chance: its weight is divided by its probability, so that passes average to all. A photon has one.
// Both have the albedo that all lobes over it leave: by the direction to the viewer, which for a photon is the one
// in which it goes on, if it does. Photons bounce until they are absorbed: with CONSERVING they meet no more than
// reflects what they bring, the eye all that a material says.
//
// One loop asks what lobes do, once for each direction that counts: compilers write each call of it out, and take
// long for them.
#include "lib/gathered.glsl"
#include "lib/diffuse.glsl"
#include "lib/rng.glsl"
#ifdef DISPERSION
#include "lib/wavelength.glsl"
#endif
#ifdef NO_CAUSTICS
#include "lib/no_caustics.glsl"
#endif
#ifdef EYE
#include "lib/even.glsl"
#include "lib/bounces.glsl"
#else
#include "lib/reflection.glsl"
#endif

struct Lobes { Lobe lobe0; Shape shape0; Lobe lobe1; Shape shape1; Diffuse diffuse; };

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
    return even_over_passes(DIMENSION_SHADE + uint(depth)).x;
#else
    return random4(seed, pass_index + photon_part(load_flux()), photon_number(load_flux()), DIMENSION_SHADE_PHOTON + uint(bounce)).x;
#endif
}

#ifdef LAYERS
vec3 through[LAYERS];  // what gets through each lobe of the material and through those over it
#endif

#ifdef SUBSURFACE
// Whether rays go on below surfaces from here.
bool walks() {
#ifdef WALKS
    return bounces_before() < float(chain_depth);
#else
    return false;
#endif
}
#endif

// From where lobes are asked for; those that have none of their own are about this normal.
struct Aspect { vec3 normal; vec3 geometric; vec3 toward; };

// A lobe as it is seen from there.
struct Seen {
    Lobe lobe;
    Shape shape;   // but for its weight
    float weight;
    float over;    // the lobe over it, + 1; 0: none
    vec3 above;    // what all those over it let through
    vec3 albedo;   // of the lobe itself, without either
    bool covers;   // whether it lies over Lambert's lobe
    vec3 covered;  // of whose albedo as much is seen through it
};

// All before it are asked for from there first. `by_diffuse`: by a ray of a diffuse lobe.
Seen seen_lobe(Material material, int number, Aspect from, bool by_diffuse) {
    MaterialLobe l = lobe_at(int(material.first_lobe) + number);
    Lobe lobe = Lobe(l.colour, l.kind);
    Shape shape = Shape(pack_kind(l.kind, l.parameters, l.more), 0.0);
    vec3 normal = normal_of_lobe(lobe, shape, from.normal, from.normal, from.geometric, from.toward);
    float cosine = max(0.0, dot(normal, from.toward));
    vec3 albedo = albedo_kind(lobe, shape, cosine), above = vec3(1.0);
#ifdef NO_CAUSTICS
    if (by_diffuse && is_left_out(l.kind)) {  // but for its tint
        albedo = vec3(0.0);
        l.weight = 0.0;
    }
#endif
    vec3 own = transmittance_kind(lobe, shape, cosine, albedo);
#ifdef LAYERS
    if (l.over > 0.0) above = through[int(l.over) - 1];
    through[number] = own * above;
#endif
    vec3 covered = l.covered * own * above;
    bool covers = largest(l.covered) > 0.0;
#ifdef SUBSURFACE
    if (l.kind == float(SUBSURFACE) && !walks()) {
        covered = l.weight * above * albedo;
        covers = true;
        l.weight = 0.0;
    }
#endif
    return Seen(lobe, shape, l.weight, l.over, above, albedo, covers, covered);
}

// One of several by chance, as much as each reflects.
struct Draw { Seen seen; float own; float all; float u; };

Draw no_draw() {
    vec3 none = vec3(0.0);
    return Draw(Seen(Lobe(none, 0.0), Shape(none, 0.0), 0.0, 0.0, none, none, false, none), 1.0, 0.0, choice());
}

void consider(inout Draw draw, Seen seen) {
    float own = mean(seen.weight * seen.above * seen.albedo) + 1.0e-6;
    if (!is_drawn(own, draw.all, draw.u)) return;
    draw.seen = seen;
    draw.own = own;
}

// `turn`: of the tangent (tangent.glsl); `side`: of the surface.
Shape shape_of(Seen seen, vec3 by, float turn, float side) {
    Shape shape = Shape(seen.shape.parameters, packed_weight(seen.weight * by));
#ifdef DISPERSION
    if (disperses_kind(seen.lobe.kind)) shape = weighed(shape, path_colour);
#endif
    return sided_kind(seen.lobe, turned_kind(seen.lobe, shape, turn), side);
}

Lobes no_lobes() {
    Lobe none = Lobe(vec3(0.0), 0.0);
    Shape nothing = Shape(vec3(0.0), 0.0);
    return Lobes(none, nothing, none, nothing, Diffuse(vec3(0.0), 0.0));
}

#ifdef EYE
Lobes lobes_of(Material material, Aspect from, float turn, float side) {
    Lobes found = no_lobes();
    vec3 albedo = material.albedo;
    bool lands = false, by_diffuse = false;
#ifdef NO_CAUSTICS
    by_diffuse = is_by_diffuse(load_direction().t_max);
#endif
#ifdef TWO_LOBES
    Draw draw = no_draw();
#endif
    for (int i = 0; i < int(material.lobes); i++) {
        Seen seen = seen_lobe(material, i, from, by_diffuse);
        albedo += seen.covered;
        lands = lands || seen.covers;
        if (i == 0) {
            found.lobe0 = seen.lobe;
            found.shape0 = shape_of(seen, seen.above, turn, side);
        }
#ifdef TWO_LOBES
        else consider(draw, seen);
#endif
    }
#ifdef TWO_LOBES
    found.lobe1 = draw.seen.lobe;
    found.shape1 = shape_of(draw.seen, draw.seen.above * (draw.all / draw.own), turn, side);
#endif
    found.diffuse = bare_diffuse(albedo);
    if (lands) found.diffuse = with_photons(found.diffuse);
    return found;
}
#else
// From where layers are weighed for a photon that goes on to the eye, or for one that came through them.
Aspect aspect_of_viewer(Facing facing, Shading shading, vec3 onward) {
    vec3 toward = dot(onward, facing.normal) < 0.0 ? -onward : onward;
    return Aspect(raised_normal(shading.normal, facing.normal, toward), facing.normal, toward);
}

// To where a round asks what lobes do.
#ifdef CONSERVING
const int FOR_ALL = 0;      // the light that comes: how much all of them reflect together
const int FOR_CHOICE = 1;   // which of them has the photon
#else
const int FOR_CHOICE = 0;
#endif
const int FOR_LAMBERT = FOR_CHOICE + 1;  // to where Lambert's lobe sends it: how much of that is seen
const int FOR_LOBE = FOR_CHOICE + 2;     // to where the lobe that was drawn sends it: what those over it let through
#ifdef LAYERS
const int ROUNDS = FOR_LOBE + 1;
#else
const int ROUNDS = FOR_LOBE;
#endif

#ifdef CONSERVING
const float ROUNDING_OF_ALBEDOS = 1.0e-5;  // that add up to 1

// What a material makes of the light from a photon's direction, per channel.
struct Albedos { vec3 reflected; vec3 straight; };

bool goes_straight(Seen seen) {
#ifdef TRANSPARENT
    return is_transparent(seen.lobe);
#else
    return false;
#endif
}

void add_albedo(inout Albedos all, Seen seen) {
    vec3 own = seen.weight * seen.above * seen.albedo;
    if (goes_straight(seen)) all.straight += own; else all.reflected += own;
    all.reflected += seen.covered;
}

// The share of what is reflected that no more comes of than there is but for what goes straight on.
vec3 conserved(Albedos all) {
    vec3 left = max(1.0 - all.straight, 0.0);
    bvec3 is_less = lessThanEqual(all.reflected, left + ROUNDING_OF_ALBEDOS);
    return mix(left / max(all.reflected, ROUNDING_OF_ALBEDOS), vec3(1.0), is_less);
}
#endif

Lobes lobes_of(Material material, vec3 position, Facing facing, Shading shading, vec3 to_light, float turn) {
    Lobes found = no_lobes();
    vec3 albedo = material.albedo, onward = diffuse_way(position, facing, reflection_numbers(load_flux())).direction;
    int lobes = int(material.lobes);
    Aspect from = Aspect(shading.normal, facing.normal, to_light);
    Draw draw = no_draw();
#ifdef CONSERVING
    Albedos all = Albedos(albedo, vec3(0.0));
    vec3 share = vec3(1.0);
#endif
    for (int k = 0; k < ROUNDS * lobes; k++) {
        int round = k / lobes, i = k - round * lobes;
#ifdef CONSERVING
        if (k == FOR_CHOICE * lobes) {
            share = conserved(all);
            albedo *= share;
        }
#endif
        if (k == FOR_LAMBERT * lobes) {
            from = aspect_of_viewer(facing, shading, onward);
            found.lobe0 = draw.seen.lobe;
            vec3 by = vec3(draw.all / draw.own);
#ifdef CONSERVING
            if (!goes_straight(draw.seen)) by *= share;
#endif
            found.shape0 = shape_of(draw.seen, by, turn, facing.side);
        }
#ifdef LAYERS
        if (k == FOR_LOBE * lobes && draw.seen.over > 0.0) {
            vec3 normal = normal_of_lobe(found.lobe0, found.shape0, shading.normal, facing.normal, to_light);
            vec4 u = reflection_numbers(load_flux());
            onward = lobe_way(found.lobe0, found.shape0, position, facing, normal, to_light, u).direction;
            from = aspect_of_viewer(facing, shading, onward);
        }
        if (round == FOR_LOBE && float(i) >= draw.seen.over) break;
#endif
        // Whatever finds the light that goes on, where caustics are left out, is taken for a ray of a diffuse lobe.
        Seen seen = seen_lobe(material, i, from, round != FOR_CHOICE);
#ifdef CONSERVING
        if (round == FOR_ALL) add_albedo(all, seen);
        if (!goes_straight(seen)) seen.above *= share;  // for the choice
        seen.covered *= share;
#endif
        if (round == FOR_LAMBERT) albedo += seen.covered;
        if (round == FOR_CHOICE) consider(draw, seen);
    }
#ifdef LAYERS
    if (draw.seen.over > 0.0) found.shape0 = weighed(found.shape0, through[int(draw.seen.over) - 1]);
#endif
    found.diffuse = bare_diffuse(albedo);
    return found;
}
#endif
