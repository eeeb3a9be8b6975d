// SPDX-License-Identifier: GPL-3.0-or-later
// A spotlight in Blender's units: a point light, of which a cone is left. Full power inside the inner cone, a
// smooth step down to darkness at the outer one. The cone may be stretched sideways.
// Parameters: radius [m], soft [0 or 1], outer [1 - cos], inner [1 - cos], stretch_x [over z's], stretch_y [over z's]. Power: W.
#include "lights/point.glsl"

// The share of P / (4 PI) that leaves at 1 - cos(theta) = versine from the axis.
float spot_share(Light light, float versine) {
    float outer = light.parameters.z, inner = light.parameters.w;
    if (versine <= inner) return 1.0;
    if (versine >= outer) return 0.0;
    float t = (outer - versine) / (outer - inner);
    return t * t * (3.0 - 2.0 * t);
}

// The versine for u in [0, 1), with a density that goes with spot_share; grows with u.
float sample_spot_versine(Light light, float u) {
    float outer = light.parameters.z, inner = light.parameters.w, fading = outer - inner;
    float x = u * (inner + 0.5 * fading);
    if (x < inner) return x;
    // The rest follows the smooth step: t from 1 down to 0 with 2 t^3 - t^4 = 1 - (x - inner) / (fading / 2).
    float rest = clamp(1.0 - (x - inner) / (0.5 * fading), 0.0, 1.0);
    float t = pow(0.5 * rest, 1.0 / 3.0);  // exact as t -> 0, then Newton; the function is convex-concave but monotone
    for (int i = 0; i < 6; i++) {
        float slope = t * t * (6.0 - 4.0 * t);
        if (slope > 0.0) t = clamp(t - (t * t * t * (2.0 - t) - rest) / slope, 0.0, 1.0);
    }
    return outer - t * fading;
}

// That of a direction from the light, and of the cone as it was before it was stretched.
float share_of_spot(Light light, vec3 direction) {
    if (light.more.xy == vec2(1.0)) return spot_share(light, versine_between(direction, light.axis));
    vec3 local = direction * mat3(light.across, cross(light.axis, light.across), light.axis);
    local = normalize(vec3(local.xy / light.more.xy, local.z));
    return spot_share(light, versine_between(local, vec3(0.0, 0.0, 1.0)));
}

LightSample sample_spot(Light light, vec3 position, vec3 normal, vec2 u) {
    LightSample found = sample_point(light, position, normal, u);
    vec3 axis = position - light.position;
    if (!is_inside(light, dot(axis, axis)) || light.parameters.x == 0.0) found.share *= share_of_spot(light, -found.to_light);
    return found;
}

float pdf_spot(Light light, vec3 position, vec3 normal, vec3 to_light) {
    return pdf_point(light, position, normal, to_light);
}

LightRay emit_spot(Light light, vec2 u, vec2 on_light) {
    float versine = sample_spot_versine(light, u.x);
    if (light.more.xy == vec2(1.0)) return emitted_by_point(light, about_axis(light, versine, u.y), on_light);
    vec3 stretched = direction_from_versine(versine, 2.0 * PI * u.y) * vec3(light.more.xy, 1.0);
    float longer = length(stretched);
    mat3 frame = mat3(light.across, cross(light.axis, light.across), light.axis);
    LightRay emitted = emitted_by_point(light, frame * (stretched / longer), on_light);
    // How much wider a solid angle becomes.
    emitted.weight = light.more.x * light.more.y / (longer * longer * longer);
    return emitted;
}

vec4 seen_spot(Light light, vec3 origin, vec3 direction, float far) {
    vec4 seen = seen_point(light, origin, direction, far);
    vec3 axis = origin - light.position;
    if (!is_inside(light, dot(axis, axis))) seen.xyz *= share_of_spot(light, -direction);
    return seen;
}

// Stretched, the cone is as wide as where it is stretched most.
LightBounds bounds_spot(Light light) {
    float cosine = max(0.0, 1.0 - light.parameters.z), sine2 = max(0.0, 1.0 - cosine * cosine);
    float wider = max(1.0, max(light.more.x, light.more.y));
    cosine /= sqrt(cosine * cosine + sine2 * wider * wider);
    return sphere_bounds(light, light.parameters.x, cosine);
}

// Integral of spot_share over all directions, over 4 PI, of a cone that is not stretched.
vec3 flux_spot(Light light) { return light.power * (PI * (light.parameters.w + light.parameters.z) / (4.0 * PI)); }
