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

// Where a photon starts, and where to.
struct LightRay { vec3 origin; vec3 direction; };

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
const int BY_GLOSSY = 4;     // shadow rays of lobes
const int BY_CHAINS = 8;     // rays of lobes
const int IS_WORLD = 16;     // it is what lies behind all

bool is_found(Light light, int by) { return (int(light.found_by) & by) != 0; }

// 1 - cos of the angle between unit vectors, precise for small angles.
float versine_between(vec3 a, vec3 b) {
    vec3 d = a - b;
    return min(0.5 * dot(d, d), 2.0);  // rounding must not leave a point light's "cone"
}

// In a direction about the light's axis. A sphere of even radiance seen from afar is a disc: the photon
// starts on it, lifted to the sphere.
LightRay emitted_by_sphere(Light light, float versine, float turn, vec2 on_light, float radius) {
    vec3 direction = frame_about(light.axis) * direction_from_versine(versine, 2.0 * PI * turn);
    vec2 disc = sample_disc(on_light);
    vec3 lift = vec3(disc, sqrt(max(0.0, 1.0 - dot(disc, disc)))) * radius;
    return LightRay(light.position + frame_about(direction) * lift, direction);
}

// From afar in a direction: through a disc that the scene, of this radius about the origin, lies behind.
LightRay emitted_by_surroundings(vec3 direction, vec2 on_disc, float radius) {
    vec3 place = vec3(sample_disc(on_disc), -1.0) * radius;
    return LightRay(frame_about(direction) * place, direction);
}

// The radiance of a sphere of even brightness about a light, where a ray first meets it from outside and before
// `far`; and how bright a point light of `power` makes it.
vec3 seen_sphere(Light light, float radius, vec3 origin, vec3 direction, float far) {
    vec3 to_middle = light.position - origin;
    float along = dot(to_middle, direction), radius2 = radius * radius;
    vec3 off = to_middle - along * direction;
    float beside2 = dot(off, off);
    if (!(along > 0.0) || !(beside2 < radius2) || dot(to_middle, to_middle) <= radius2) return vec3(0.0);
    return along - sqrt(radius2 - beside2) < far ? light.power / (4.0 * PI * PI * radius2) : vec3(0.0);
}

#include "made/lights.glsl"
