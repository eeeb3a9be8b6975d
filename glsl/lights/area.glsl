// SPDX-License-Identifier: GPL-3.0-or-later
// A rectangle or an ellipse that shines to one side, evenly: P / (PI area) [W/(m^2 sr)] from all directions, or
// as through a grid of slats: the narrower its spread, the brighter along the axis. Its width lies across.
// Parameters: width [m], height [m], round [0 or 1], cotangent [of half the spread], gain [along the axis]. Power: W.
#include "lib/spherical_rectangle.glsl"

// What of the light a place may see: a rectangle on its plane, or the whole disc. Distances from that plane and the
// light's middle.
struct VisiblePart {
    vec3 place;
    vec2 low;
    vec2 high;
    bool is_disc;  // samples go by the whole ellipse's surface; else by the rectangle,
    float angle;   // and by this solid angle of it, or 0: by its surface
};

// Below, sums of angles are not precise enough.
const float LEAST_SOLID_ANGLE = 5.0e-3;

mat3 frame_of_area(Light light) { return mat3(light.across, cross(light.axis, light.across), light.axis); }

float surface_of(Light light) {
    return light.parameters.x * light.parameters.y * (light.parameters.z > 0.0 ? 0.25 * PI : 1.0);
}

bool is_in_area(Light light, vec2 place) {
    vec2 within = 2.0 * place / light.parameters.xy;
    return light.parameters.z > 0.0 ? dot(within, within) <= 1.0 : max(abs(within.x), abs(within.y)) <= 1.0;
}

VisiblePart visible_part(Light light, vec3 position) {
    vec3 place = (position - light.position) * frame_of_area(light);
    vec2 size = light.parameters.xy;
    VisiblePart part = VisiblePart(place, -0.5 * size, 0.5 * size, false, 0.0);
    if (light.parameters.w > 0.0) {
        float reach = place.z / light.parameters.w;
        part.low = max(part.low, place.xy - reach);
        part.high = min(part.high, place.xy + reach);
    }
    vec2 beside = max(vec2(0.0), abs(place.xy) - 0.5 * size), left = part.high - part.low;
    bool is_near = dot(beside, beside) + place.z * place.z < dot(size, size);
    bool is_small = left.x * left.y < surface_of(light);
    part.is_disc = light.parameters.z > 0.0 && !is_near && !is_small;
    float angle = rectangle_solid_angle(place, part.low, part.high);
    if (angle > LEAST_SOLID_ANGLE) part.angle = angle;
    return part;
}

bool sees_area(VisiblePart part) {
    return part.place.z > 0.0 && part.low.x < part.high.x && part.low.y < part.high.y;
}

// What the slats let through, over what leaves without them.
float spread_share(Light light, float cosine) {
    if (!(light.parameters.w > 0.0)) return 1.0;
    float tangent = sqrt(max(0.0, 1.0 - cosine * cosine)) / cosine;
    return light.more.x * max(0.0, 1.0 - light.parameters.w * tangent);
}

// One over the density of samples per solid angle.
float inverse_density(Light light, VisiblePart part, float far, float cosine) {
    if (!part.is_disc && part.angle > 0.0) return part.angle;
    vec2 size = part.high - part.low;
    return (part.is_disc ? surface_of(light) : size.x * size.y) * cosine / (far * far);
}

LightSample sample_area(Light light, vec3 position, vec3 normal, vec2 u) {
    VisiblePart part = visible_part(light, position);
    if (!sees_area(part)) return no_light();
    vec2 met = mix(part.low, part.high, u);
    if (part.is_disc) met = 0.5 * light.parameters.xy * sample_disc(u);
    else if (part.angle > 0.0) met = sample_spherical_rectangle(part.place, part.low, part.high, u);
    vec3 to_light = vec3(met, 0.0) - part.place;
    float far = length(to_light), cosine = -to_light.z / far;
    if (!is_in_area(light, met) || !(cosine > 0.0)) return no_light();
    vec3 irradiance = light.power / (PI * surface_of(light)) * inverse_density(light, part, far, cosine);
    return LightSample(frame_of_area(light) * (to_light / far), far, irradiance, spread_share(light, cosine));
}

float pdf_area(Light light, vec3 position, vec3 normal, vec3 to_light) {
    VisiblePart part = visible_part(light, position);
    vec3 direction = to_light * frame_of_area(light);
    if (!sees_area(part) || !(direction.z < 0.0)) return 0.0;
    float far = -part.place.z / direction.z;
    vec2 met = part.place.xy + far * direction.xy;
    if (!is_in_area(light, met)) return 0.0;
    if (!part.is_disc && (any(lessThan(met, part.low)) || any(greaterThan(met, part.high)))) return 0.0;
    return 1.0 / inverse_density(light, part, far, -direction.z);
}

// The angle from the axis of u's share of the photons; grows with u. Of the flux
// sin^2 a - cot h (a - sin a cos a) over 1 - h cot h lies within an angle a, h being half the spread.
float sample_spread(Light light, float u) {
    float cotangent = light.parameters.w;
    if (!(cotangent > 0.0)) return asin(sqrt(u));
    float widest = atan(1.0, cotangent), wanted = u / light.more.x;
    float angle = widest * (0.5 - sin(asin(1.0 - 2.0 * u) / 3.0));  // exact as h -> 0, then Newton
    for (int i = 0; i < 5; i++) {
        float slope = 2.0 * sin(angle) * (cos(angle) - cotangent * sin(angle));
        float within = sin(angle) * sin(angle) - 0.5 * cotangent * beyond_sine(2.0 * angle);
        if (slope > 0.0) angle = clamp(angle - (within - wanted) / slope, 0.0, widest);
    }
    return angle;
}

LightRay emit_area(Light light, vec2 u, vec2 on_light) {
    float angle = sample_spread(light, u.x), turn = 2.0 * PI * u.y;
    vec3 direction = vec3(sin(angle) * vec2(cos(turn), sin(turn)), cos(angle));
    vec2 place = light.parameters.z > 0.0 ? 0.5 * sample_disc(on_light) : on_light - 0.5;
    mat3 frame = frame_of_area(light);
    return LightRay(light.position + frame * vec3(place * light.parameters.xy, 0.0), normalize(frame * direction), 1.0);
}

vec3 cosine_axis_area(Light light, vec3 direction) { return light.parameters.w > 0.0 ? vec3(0.0) : light.axis; }

vec4 seen_area(Light light, vec3 origin, vec3 direction, float far) {
    mat3 frame = frame_of_area(light);
    vec3 place = (origin - light.position) * frame, local = direction * frame;
    if (!(place.z > 0.0) || !(local.z < 0.0)) return vec4(0.0);
    float along = -place.z / local.z;
    if (!(along < far) || !is_in_area(light, place.xy + along * local.xy)) return vec4(0.0);
    return vec4(light.power * (spread_share(light, -local.z) / (PI * surface_of(light))), along);
}

LightBounds bounds_area(Light light) {
    mat3 frame = frame_of_area(light);
    vec3 half_size = 0.5 * (abs(frame[0]) * light.parameters.x + abs(frame[1]) * light.parameters.y);
    return LightBounds(light.position - half_size, light.position + half_size, light.axis, 1.0, 0.0);
}

vec3 flux_area(Light light) { return light.power; }
