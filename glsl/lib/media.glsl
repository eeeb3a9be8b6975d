// SPDX-License-Identifier: GPL-3.0-or-later
// Media: what is inside meshes, or everywhere, that absorbs and scatters light on its way (Beer and Lambert). A ray holds
// the numbers of those that it is in, by the surfaces that it has gone through: so meshes may overlap, and hold others.
// Four at most; what is deeper than that is not there. Uses the tables of triangles, materials and interiors.
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

vec2 inside_with(vec2 inside, float number) {
    int place = place_of(inside, 0.0);
    return place < 0 ? inside : inside + at_place(number, place);
}

vec2 inside_without(vec2 inside, float number) {
    int place = place_of(inside, number);
    return place < 0 ? inside : inside - at_place(number, place);
}

// Of the mesh whose surface a ray meets; 0: none.
float interior_behind(Hit hit) { return material_at(int(triangle_at(hit_triangle(hit)).material)).interior; }

// On a ray's way to a surface of a mesh of this interior. One that meets the back has come from inside it, also where
// nothing has told so. `side`: Facing's.
vec2 inside_before(vec2 inside, float own, float side) {
    return side < 0.0 && own > 0.0 && place_of(inside, own) < 0 ? inside_with(inside, own) : inside;
}

// On its way behind the surface.
Medium medium_behind(Medium medium, Hit hit, float side) {
    float own = interior_behind(hit);
    if (!(own > 0.0)) return medium;
    vec2 before = inside_before(medium.inside, own, side);
    medium.inside = side > 0.0 ? inside_with(before, own) : inside_without(before, own);
    return medium;
}

// All that it is in together; the anisotropy is the mean of what they scatter.
Interior interior_of(vec2 inside) {
    Interior all = Interior(vec3(0.0), 0.0, vec3(0.0));
    float turned = 0.0, scattered = 0.0;
    for (int place = 0; place < MOST_MEDIA && inside != vec2(0.0); place++) {
        float number = medium_number(inside, place);
        if (!(number > 0.0)) continue;
        Interior one = interior_at(int(number) - 1);
        all.extinction += one.extinction;
        all.scattering += one.scattering;
        float own = one.scattering.r + one.scattering.g + one.scattering.b;
        turned += own * one.anisotropy;
        scattered += own;
    }
    if (scattered > 0.0) all.anisotropy = turned / scattered;
    return all;
}

// What a way leaves of light. The longest there is, times what exp2 takes for exp, were infinite, and times 0 no number.
const float LONGEST = 1.0e30;

vec3 left_of(vec3 extinction, float way) { return exp(-min(way, LONGEST) * extinction); }

vec3 left_after(vec2 inside, float way) {
    return inside == vec2(0.0) ? vec3(1.0) : left_of(interior_of(inside).extinction, way);
}

vec3 left_before(Medium medium, Hit hit, float side) {
    return left_after(inside_before(medium.inside, interior_behind(hit), side), hit.t);
}
