// SPDX-License-Identifier: GPL-3.0-or-later
// Places on a way where lamps and emissive meshes are brightest: by the angle under which each sees the way, their shares of
// all beside (Kulla & Fajardo 2012, "Importance Sampling Techniques for Path Tracing in Participating Media"). Uses the table
// beams and the uniform beam_count.
#include "lib/constants.glsl"

const float NEAREST = 1.0e-5;  // that a way is taken to pass by

// Where a way comes nearest to a place, and how near; the angles to its ends from there.
struct Passing { float nearest; float height; float begin; float end; };

Passing passing_by(vec3 origin, vec3 direction, float far, vec3 position) {
    vec3 to_place = position - origin;
    float nearest = dot(to_place, direction);
    float height = max(length(to_place - nearest * direction), NEAREST);
    return Passing(nearest, height, atan(-nearest, height), atan(far - nearest, height));
}

float pdf_passing(Passing by, float t) {
    float beyond = t - by.nearest;
    return by.height / (max(by.end - by.begin, 1.0e-7) * (by.height * by.height + beyond * beyond));
}

float sample_beams(vec3 origin, vec3 direction, float far, vec2 u) {
    int number = 0;
    while (number < beam_count - 1 && u.x >= beam_at(number).up_to) number++;
    Passing by = passing_by(origin, direction, far, beam_at(number).position);
    return clamp(by.nearest + by.height * tan(mix(by.begin, by.end, u.y)), 0.0, far);
}

float pdf_beams(vec3 origin, vec3 direction, float far, float t) {
    float sum = 0.0, below = 0.0;
    for (int i = 0; i < beam_count; i++) {
        Beam beam = beam_at(i);
        sum += (beam.up_to - below) * pdf_passing(passing_by(origin, direction, far, beam.position), t);
        below = beam.up_to;
    }
    return sum;
}
