// SPDX-License-Identifier: GPL-3.0-or-later
// An emissive triangle of a mesh, of one radiance on both sides in the mean. Its position is its first corner, its axis
// the normal; its number is that in the scene; its shares tell how much of the radiance is where (lib/emission_share.glsl).
// Parameters: b [mesh], number [mesh], c [mesh], shares [mesh]. Power: W/(m^2 sr).
#include "lib/offset.glsl"
#include "lib/spherical_triangle.glsl"

// Seen larger than this it is sampled by solid angle [sr]: by area, what is near would be noise. At the upper end
// the place lies in the triangle.
const float LARGE = 0.01;
const float MOST = 6.28;
// Shadow rays end so far above it, or they would meet it: as far as they are lifted off the surface that they leave,
// and as much again for rounding.
const float ABOVE = 3.0 * SURFACE_OFFSET;

float area_of(Light light) {
    return 0.5 * length(cross(light.parameters.xyz - light.position, light.more.xyz - light.position));
}

bool is_large(float angle) { return angle > LARGE && angle < MOST; }

// Per solid angle, in a direction that meets it so far away.
float density_by_area(Light light, vec3 to_light, float far) {
    float seen = area_of(light) * abs(dot(light.axis, to_light));
    return seen > 0.0 ? far * far / seen : 0.0;
}

LightSample sample_triangle(Light light, vec3 position, vec3 normal, vec2 u) {
    vec3 a = light.position - position, b = light.parameters.xyz - position, c = light.more.xyz - position;
    float angle = solid_angle(normalize(a), normalize(b), normalize(c));
    if (is_large(angle)) {
        vec3 to_light = sample_solid_angle(normalize(a), normalize(b), normalize(c), angle, u);
        float height = dot(light.axis, a), falling = dot(light.axis, to_light);
        float most = max(length(a), max(length(b), length(c)));
        float far = height * falling > 0.0 ? min(height / falling, most) : most;
        return LightSample(to_light, far - ABOVE / max(abs(falling), ABOVE), light.power * angle, 1.0);
    }
    float root = sqrt(u.x);
    vec3 to_place = a + (root * (1.0 - u.y)) * (b - a) + (root * u.y) * (c - a);
    float far = length(to_place);
    if (!(far > 0.0)) return no_light();
    vec3 to_light = to_place / far;
    float density = density_by_area(light, to_light, far), falling = dot(light.axis, to_light);
    if (!(density > 0.0)) return no_light();
    return LightSample(to_light, far - ABOVE / max(abs(falling), ABOVE), light.power / density, 1.0);
}

float pdf_triangle(Light light, vec3 position, vec3 normal, vec3 to_light) {
    vec3 a = light.position - position, b = light.parameters.xyz - position, c = light.more.xyz - position;
    vec3 to_a = normalize(a), to_b = normalize(b), to_c = normalize(c);
    if (!is_within(to_a, to_b, to_c, to_light)) return 0.0;
    float angle = solid_angle(to_a, to_b, to_c), falling = dot(light.axis, to_light);
    if (is_large(angle)) return 1.0 / angle;
    return falling == 0.0 ? 0.0 : density_by_area(light, to_light, dot(light.axis, a) / falling);
}

LightRay emit_triangle(Light light, vec2 u, vec2 on_light) {
    float root = sqrt(on_light.x);
    vec3 place = light.position + (root * (1.0 - on_light.y)) * (light.parameters.xyz - light.position)
        + (root * on_light.y) * (light.more.xyz - light.position);
    vec3 normal = u.x < 0.5 ? light.axis : -light.axis;
    vec3 direction = frame_about(normal) * sample_cosine_hemisphere(vec2(fract(2.0 * u.x), u.y));
    return LightRay(offset_origin(place, normal, direction), direction, 1.0);
}

vec3 cosine_axis_triangle(Light light, vec3 direction) {
    return dot(light.axis, direction) > 0.0 ? light.axis : -light.axis;
}

vec4 seen_triangle(Light light, vec3 origin, vec3 direction, float far) {
    vec3 a = light.position - origin, b = light.parameters.xyz - origin, c = light.more.xyz - origin;
    if (!is_within(normalize(a), normalize(b), normalize(c), direction)) return vec4(0.0);
    float falling = dot(light.axis, direction);
    float met = falling != 0.0 ? dot(light.axis, a) / falling : far;
    return met < far ? vec4(light.power, met) : vec4(0.0);
}

LightBounds bounds_triangle(Light light) {
    vec3 a = light.position, b = light.parameters.xyz, c = light.more.xyz;
    return LightBounds(min(a, min(b, c)), max(a, max(b, c)), light.axis, 1.0, BOTH_SIDES);
}

vec3 flux_triangle(Light light) { return light.power * (2.0 * PI * area_of(light)); }
