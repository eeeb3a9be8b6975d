// SPDX-License-Identifier: GPL-3.0-or-later
// Lights, whatever their kind: made/lights.glsl has those of the scene. Uses the table of lights.
#include "lib/sampling.glsl"

// Light that arrives at a place from a direction that was sampled.
struct LightSample {
    vec3 to_light;    // unit
    float far;        // how far the light is
    vec3 irradiance;  // radiance over the density [W/m^2], at normal incidence
    float share;      // of it, by the light's own profile; 0: none
};

LightSample no_light() { return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0); }

// Where a photon starts, where to, and its flux over the light's.
struct LightRay { vec3 origin; vec3 direction; float weight; };

// Where a light is, and where it shines: off the axis by an angle of the cosine `spread`, and from there on as far as
// that of the cosine `reach`, ever less.
struct LightBounds { vec3 low; vec3 high; vec3 axis; float spread; float reach; };

const float ALL_AROUND = -1.0;  // a spread
const float BOTH_SIDES = 2.0;   // a reach: along the axis and against it, to a right angle

LightBounds sphere_bounds(Light light, float radius, float spread) {
    return LightBounds(light.position - radius, light.position + radius, light.axis, spread, 1.0);
}

// Whom a light is found by: bits of Light.found_by.
const int BY_CAMERA = 1;
const int BY_DIFFUSE = 2;    // shadow rays of diffuse surfaces
const int BY_GLOSSY = 4;     // shadow rays of lobes that reflect
const int BY_TRANSMISSION = 8;  // shadow rays of those that let through
const int BY_TRANSLUCENT = 16;  // shadow rays of diffuse lobes that do
const int BY_MEDIA = 32;     // shadow rays of places in media
const int BY_CHAINS = 64;    // rays that lobes reflect
const int BY_PASSING = 128;  // rays of lobes that pass through a surface
const int SOFT_BIT = 256;    // no finder: it is a disc that faces whoever looks

// Its strength at a distance over what falls off with the distance squared (table of lights).
float share_at(Light light, float far) {
    if (light.falloff == 0.0 && light.smoothing == 0.0) return 1.0;
    float distance2 = far * far;
    float share = light.smoothing > 0.0 ? distance2 / (light.smoothing + distance2) : 1.0;
    return light.falloff == 2.0 ? share * distance2 : (light.falloff == 1.0 ? share * far : share);
}

const int GLOW_BIT = 512;    // nor this: it stands for what a medium emits, which rays of lobes find on their way

bool is_found(Light light, int by) { return (int(light.found_by) & by) != 0; }

bool is_soft(Light light) { return (int(light.found_by) & SOFT_BIT) != 0; }

bool is_glow(Light light) { return (int(light.found_by) & GLOW_BIT) != 0; }

// 1 - cos of the angle between unit vectors, precise for small angles.
float versine_between(vec3 a, vec3 b) {
    vec3 d = a - b;
    return min(0.5 * dot(d, d), 2.0);  // rounding must not leave a point light's "cone"
}

vec3 about_axis(Light light, float versine, float turn) {
    return frame_about(light.axis) * direction_from_versine(versine, 2.0 * PI * turn);
}

// A sphere of even radiance seen from afar is a disc: the photon starts on it, or lifted to the sphere.
LightRay emitted_by_sphere(Light light, vec3 direction, vec2 on_light, float radius, bool is_lifted) {
    vec2 disc = sample_disc(on_light);
    vec3 lift = vec3(disc, is_lifted ? sqrt(max(0.0, 1.0 - dot(disc, disc))) : 0.0) * radius;
    return LightRay(light.position + frame_about(direction) * lift, direction, 1.0);
}

// From afar in a direction: through a disc that the scene, of this radius about the origin, lies behind.
LightRay emitted_by_surroundings(vec3 direction, vec2 on_disc, float radius) {
    vec3 place = vec3(sample_disc(on_disc), -1.0) * radius;
    return LightRay(frame_about(direction) * place, direction, 1.0);
}

// What a ray sees of a light: the radiance where it first meets the light before `far`, and how far that is; else 0.
// Of a sphere of even brightness about a light, from inside too; and how bright a point light of `power` makes it.
vec4 seen_sphere(Light light, float radius, vec3 origin, vec3 direction, float far) {
    vec3 to_middle = light.position - origin;
    float along = dot(to_middle, direction), radius2 = radius * radius;
    vec3 off = to_middle - along * direction;
    float beside2 = dot(off, off);
    bool is_inside = dot(to_middle, to_middle) <= radius2;
    if (!(beside2 < radius2) || !(along > 0.0 || is_inside)) return vec4(0.0);
    float to_middle_plane = sqrt(radius2 - beside2);
    float met = along + (is_inside ? to_middle_plane : -to_middle_plane);
    return met < far ? vec4(light.power / (4.0 * PI * PI * radius2), met) : vec4(0.0);
}

// Of as bright a disc about the light, which faces the ray's origin.
vec4 seen_facing_disc(Light light, float radius, vec3 origin, vec3 direction, float far) {
    vec3 to_middle = light.position - origin;
    float along = dot(to_middle, direction), distance2 = dot(to_middle, to_middle), radius2 = radius * radius;
    vec3 off = to_middle - along * direction;
    if (!(along > 0.0) || !(dot(off, off) * distance2 < radius2 * along * along)) return vec4(0.0);
    float met = distance2 / along;
    return met < far ? vec4(light.power / (4.0 * PI * PI * radius2), met) : vec4(0.0);
}

#ifdef PROFILES
#include "lib/profile.glsl"
#endif
#include "made/lights.glsl"
#ifdef GOBOS
#include "lib/gobo.glsl"
#endif
#ifdef EMISSION_SHARES
#include "lib/emission_share.glsl"
#endif

// What its nodes make of a light where it is met at a distance in a direction.
float share_by_nodes(Light light, vec3 to_light, float far) {
#ifdef PROFILES
    return share_at(light, far) * profile_share(light, -to_light);
#else
    return share_at(light, far);
#endif
}

// And of its colour, at a place on it, of what leaves it in a direction.
vec3 colour_by_nodes(Light light, vec3 place, vec3 direction) {
#ifdef EMISSION_SHARES
    if (light.kind == float(TRIANGLE_LIGHT)) return emission_share(light, place, direction);
#endif
#ifdef GOBOS
    return gobo_colour(light, place, direction);
#else
    return vec3(1.0);
#endif
}

LightRay emitted_by_light(Light light, vec2 u, vec2 on_light) {
    LightRay emitted = emit_light(light, u, on_light);
#ifdef PROFILES
    emitted.weight *= profile_share(light, emitted.direction);
#endif
    return emitted;
}
