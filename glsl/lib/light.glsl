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
struct Emitted { vec3 origin; vec3 direction; };

// 1 - cos of the angle between unit vectors, precise for small angles.
float versine_between(vec3 a, vec3 b) {
    vec3 d = a - b;
    return min(0.5 * dot(d, d), 2.0);  // rounding must not leave a point light's "cone"
}

// In a direction about the light's axis. A sphere of even radiance seen from afar is a disc: the photon
// starts on it, lifted to the sphere.
Emitted emitted_by_sphere(Light light, float versine, float turn, vec2 on_light, float radius) {
    vec3 direction = frame_about(light.axis) * direction_from_versine(versine, 2.0 * PI * turn);
    vec2 disc = sample_disc(on_light);
    vec3 lift = vec3(disc, sqrt(max(0.0, 1.0 - dot(disc, disc)))) * radius;
    return Emitted(light.position + frame_about(direction) * lift, direction);
}

#include "made/lights.glsl"
