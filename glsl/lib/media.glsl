// SPDX-License-Identifier: GPL-3.0-or-later
// Media: what is inside meshes, or everywhere, that absorbs and scatters light on its way (Beer and Lambert). A ray holds
// the numbers of those that it is in, by the surfaces that it has gone through: so meshes may overlap, and hold others.
// Four at most; what is deeper than that is not there. Uses the tables of triangles,
// materials and interiors; VARYING, those of grids and voxels.
#include "lib/hit.glsl"
#include "lib/triangle.glsl"

const int MOST_MEDIA = 4;
const float NUMBERS = 4096.0;  // of media: two share a float

float medium_number(vec2 inside, int place) {
    float both = place < 2 ? inside.x : inside.y, high = floor(both / NUMBERS);
    return (place & 1) == 0 ? both - NUMBERS * high : high;
}

vec2 at_place(float number, int place) {
    float own = (place & 1) == 0 ? number : NUMBERS * number;
    return place < 2 ? vec2(own, 0.0) : vec2(0.0, own);
}

// Where a number stands; below 0: nowhere.
int place_of(vec2 inside, float number) {
    for (int place = 0; place < MOST_MEDIA; place++) {
        if (medium_number(inside, place) == number) return place;
    }
    return -1;
}

// What a ray is in it is not in twice, where a thing's surfaces overlap.
vec2 inside_with(vec2 inside, float number) {
    int place = place_of(inside, number) < 0 ? place_of(inside, 0.0) : -1;
    return place < 0 ? inside : inside + at_place(number, place);
}

vec2 inside_without(vec2 inside, float number) {
    int place = place_of(inside, number);
    return place < 0 ? inside : inside - at_place(number, place);
}

// Of the mesh whose surface a ray meets; 0: none.
float interior_behind(Hit hit) { return material_at(int(triangle_at(hit_triangle(hit)).material)).interior; }

// On a ray's way behind a surface. One that meets the back of a mesh need not come from inside it: that may be open.
// `side`: Facing's.
Medium medium_behind(Medium medium, Hit hit, float side) {
    float own = interior_behind(hit);
    if (!(own > 0.0)) return medium;
    medium.inside = side > 0.0 ? inside_with(medium.inside, own) : inside_without(medium.inside, own);
    return medium;
}

#ifdef VARYING
#include "lib/voxels.glsl"
#endif

// All that it is in together, in the mean, or where they vary at a place; the anisotropy is the mean of what they scatter.
Interior interior_of(vec2 inside, vec3 place, bool in_the_mean) {
    Interior all = Interior(vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0);
    float turned = 0.0, scattered = 0.0;
    for (int i = 0; i < MOST_MEDIA && inside != vec2(0.0); i++) {
        float number = medium_number(inside, i);
        if (!(number > 0.0)) continue;
        Interior one = interior_at(int(number) - 1);
#ifdef VARYING
        if (one.grid > 0.0 && !in_the_mean) one = varied(one, place);
#endif
        all.extinction += one.extinction;
        all.scattering += one.scattering;
        float own = one.scattering.r + one.scattering.g + one.scattering.b;
        turned += own * one.anisotropy;
        scattered += own;
    }
    if (scattered > 0.0) all.anisotropy = turned / scattered;
    return all;
}

// The longest way there is, times what exp2 takes for exp, were infinite, and times 0 no number.
const float LONGEST = 1.0e30;

// How far a way has been gone, what is lost of light by then, as optical depths, what a medium loses there, and where that is
// asked what media have emitted until there.
struct Gone {
    float t; vec3 depth; vec3 extinction;
#ifdef GLOWING
    vec3 glow;
#endif
};

#ifdef GLOWING
#include "lib/glow.glsl"
#endif

#ifdef VARYING
#include "lib/steps.glsl"
#else
// As far as `far` on a way, or until light of a channel has a depth behind it; below 0: of none.
Gone gone_along(vec2 inside, vec3 origin, vec3 direction, float way, float far, int channel, float target) {
    vec3 lost = interior_of(inside, origin, true).extinction;
    float t = min(far, LONGEST);
    if (channel >= 0) t = min(t, target / lost[channel]);
    Gone gone;
    gone.t = t;
    gone.depth = lost * t;
    gone.extinction = lost;
#ifdef GLOWING
    vec3 emitted = emitted_at(inside, origin, true);
    gone.glow = glow_between(emitted, emitted, lost, lost, t);
#endif
    return gone;
}
#endif

// What a way leaves of light.
vec3 left_after(vec2 inside, vec3 origin, vec3 direction, float far) {
    return inside == vec2(0.0) ? vec3(1.0) : exp(-gone_along(inside, origin, direction, far, far, -1, 0.0).depth);
}
