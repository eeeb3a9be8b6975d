// SPDX-License-Identifier: GPL-3.0-or-later
// Places on a way where lamps and emissive meshes are brightest: by the angle under which each sees the way, their shares of
// all beside (Kulla & Fajardo 2012, "Importance Sampling Techniques for Path Tracing in Participating Media"). Uses the table
// beams and the uniform beam_count.
#include "lib/constants.glsl"

const float NEAREST = 1.0e-5;  // that a way is taken to pass by
const float ROUNDING = 1.0e-6;  // of angles

// Where a way comes nearest to a place, and how near; the angles to its ends from there.
struct Passing { float nearest; float height; float begin; float end; };

// The part of a way that is in a beam's cone, if any is: else all of it.
vec2 within_cone(Beam beam, vec3 origin, vec3 direction, float far) {
    vec3 from = origin - beam.position;
    float k = beam.cosine * beam.cosine, along = dot(direction, beam.axis), before = dot(from, beam.axis);
    float a = along * along - k, b = along * before - k * dot(direction, from), c = before * before - k * dot(from, from);
    float square = b * b - a * c;
    vec2 part = vec2(0.0, far);
    if (abs(a) < 1.0e-6 || !(square > 0.0)) return part;
    float root = sqrt(square), low = (-b - sign(a) * root) / a, high = (-b + sign(a) * root) / a;
    if (a < 0.0) part = vec2(low, high);  // to the side
    else if (along > 0.0) part.x = high;  // ever more along the axis
    else part.y = low;
    part = clamp(part, 0.0, far);
    bool is_ahead = before + 0.5 * (part.x + min(part.y, part.x + 1.0)) * along > 0.0;  // or in the cone behind it
    return part.x < part.y && is_ahead ? part : vec2(0.0, far);
}

Passing passing_by(vec3 origin, vec3 direction, float far, Beam beam) {
    vec3 to_place = beam.position - origin;
    vec2 part = beam.cosine > 0.0 ? within_cone(beam, origin, direction, far) : vec2(0.0, far);
    float nearest = dot(to_place, direction);
    float height = max(length(to_place - nearest * direction), NEAREST);
    return Passing(nearest, height, atan(part.x - nearest, height), atan(part.y - nearest, height));
}

float pdf_passing(Passing by, float t) {
    float beyond = t - by.nearest, angle = atan(beyond, by.height);
    if (angle < by.begin - ROUNDING || angle > by.end + ROUNDING) return 0.0;
    return by.height / (max(by.end - by.begin, 1.0e-7) * (by.height * by.height + beyond * beyond));
}

float sample_beams(vec3 origin, vec3 direction, float far, vec2 u) {
    int number = 0;
    while (number < beam_count - 1 && u.x >= beam_at(number).up_to) number++;
    Passing by = passing_by(origin, direction, far, beam_at(number));
    return clamp(by.nearest + by.height * tan(mix(by.begin, by.end, u.y)), 0.0, far);
}

float pdf_beams(vec3 origin, vec3 direction, float far, float t) {
    float sum = 0.0, below = 0.0;
    for (int i = 0; i < beam_count; i++) {
        Beam beam = beam_at(i);
        sum += (beam.up_to - below) * pdf_passing(passing_by(origin, direction, far, beam), t);
        below = beam.up_to;
    }
    return sum;
}
