// SPDX-License-Identifier: GPL-3.0-or-later
// A spotlight in Blender's units: a point light, of which a cone is left. Full power inside the inner cone, a
// smooth step down to darkness at the outer one.
// Parameters: radius [m], outer [1 - cos], inner [1 - cos]. Power: W.
#include "lights/point.glsl"

// The share of P / (4 PI) that leaves at 1 - cos(theta) = versine from the axis.
float spot_share(Light light, float versine) {
    float outer = light.parameters.y, inner = light.parameters.z;
    if (versine <= inner) return 1.0;
    if (versine >= outer) return 0.0;
    float t = (outer - versine) / (outer - inner);
    return t * t * (3.0 - 2.0 * t);
}

// The versine for u in [0, 1), with a density that goes with spot_share; grows with u.
float sample_spot_versine(Light light, float u) {
    float outer = light.parameters.y, inner = light.parameters.z, fading = outer - inner;
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

LightSample sample_spot(Light light, vec3 position, vec3 normal, vec2 u) {
    LightSample found = sample_point(light, position, normal, u);
    found.share = spot_share(light, versine_between(-found.to_light, light.axis));
    return found;
}

float pdf_spot(Light light, vec3 position, vec3 normal, vec3 to_light) {
    return pdf_point(light, position, normal, to_light);
}

LightRay emit_spot(Light light, vec2 u, vec2 on_light) {
    return emitted_by_sphere(light, sample_spot_versine(light, u.x), u.y, on_light, light.parameters.x);
}

vec3 seen_spot(Light light, vec3 origin, vec3 direction, float far) {
    vec3 radiance = seen_sphere(light, light.parameters.x, origin, direction, far);
    return radiance * spot_share(light, versine_between(-direction, light.axis));
}

LightBounds bounds_spot(Light light) { return sphere_bounds(light, light.parameters.x, 1.0 - light.parameters.y); }

// Integral of spot_share over all directions, over 4 PI.
vec3 flux_spot(Light light) { return light.power * (PI * (light.parameters.z + light.parameters.y) / (4.0 * PI)); }
