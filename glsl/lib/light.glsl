// SPDX-License-Identifier: GPL-3.0-or-later
// Point lights and spotlights in Blender's units: P = energy * colour * 2^exposure [W],
// I = P / (4 PI) [W/sr]. Uses the table lights.
#include "lib/constants.glsl"
#include "lib/table.glsl"
#include "lib/sampling.glsl"

const int LIGHT_TEXELS = 4;

struct Light {
    vec3 position;
    float radius;
    vec3 axis;     // spot: unit direction of the cone
    vec3 power;    // P per channel; in scene units, so that power / distance^2 is W/m^2
    float outer;   // 1 - cos of the cone's half angle; 2 for a point light
    float inner;   // 1 - cos up to which the cone is at full power; 2 for a point light
    float chosen;  // probability with which a photon starts here
    float cdf;     // sum of `chosen` up to and including this light
};

Light light_at(int index) {
    vec4 a = texelFetch(lights, table_texel(LIGHT_TEXELS * index), 0);
    vec4 b = texelFetch(lights, table_texel(LIGHT_TEXELS * index + 1), 0);
    vec4 c = texelFetch(lights, table_texel(LIGHT_TEXELS * index + 2), 0);
    vec4 d = texelFetch(lights, table_texel(LIGHT_TEXELS * index + 3), 0);
    return Light(a.xyz, a.w, b.xyz, c.xyz, b.w, c.w, d.x, d.y);
}

// The share of P / (4 PI) that leaves at 1 - cos(theta) = versine from the axis: 1 up to the inner
// cone, a smooth step down to 0 at the outer one.
float eval_spot(Light light, float versine) {
    if (versine <= light.inner) return 1.0;
    if (versine >= light.outer) return 0.0;
    float t = (light.outer - versine) / (light.outer - light.inner);
    return t * t * (3.0 - 2.0 * t);
}

// Integral of eval_spot over all directions [sr].
float spot_solid_angle(Light light) { return PI * (light.inner + light.outer); }

float pdf_spot(Light light, float versine) { return eval_spot(light, versine) / spot_solid_angle(light); }

// The versine for u in [0, 1) with density pdf_spot (times 2 PI); grows with u.
float sample_spot(Light light, float u) {
    float fading = light.outer - light.inner;
    float x = u * (light.inner + 0.5 * fading);
    if (x < light.inner) return x;
    // The rest follows the smooth step: t from 1 down to 0 with 2 t^3 - t^4 = 1 - (x - inner) / (fading / 2).
    float rest = clamp(1.0 - (x - light.inner) / (0.5 * fading), 0.0, 1.0);
    float t = pow(0.5 * rest, 1.0 / 3.0);  // exact as t -> 0, then Newton; the function is convex-concave but monotone
    for (int i = 0; i < 6; i++) {
        float slope = t * t * (6.0 - 4.0 * t);
        if (slope > 0.0) t = clamp(t - (t * t * t * (2.0 - t) - rest) / slope, 0.0, 1.0);
    }
    return light.outer - t * fading;
}

// 1 - cos of the angle between unit vectors, precise for small angles.
float versine_between(vec3 a, vec3 b) {
    vec3 d = a - b;
    return min(0.5 * dot(d, d), 2.0);  // rounding must not leave a point light's "cone"
}
