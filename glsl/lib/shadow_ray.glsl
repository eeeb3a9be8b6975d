// SPDX-License-Identifier: GPL-3.0-or-later
// What a light would send to a visible point and on to the viewer, and the shadow ray that decides.
//
// A point asks SHADOW_RAYS lights: all there are, or where DRAWN, so many by chance, as bright as their
// probability is small.
#include "lib/rng.glsl"
#include "lib/pixel.glsl"
#include "lib/light_choice.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/offset.glsl"
#ifdef LOBES
#include "lib/lobe.glsl"
#endif

struct VisiblePoint {
    Place place;
    Facing facing;
    Shading shading;
    Diffuse diffuse;
    vec3 to_viewer;
#ifdef LOBES
    Lobe lobe0;
    Shape shape0;
#ifdef TWO_LOBES
    Lobe lobe1;
    Shape shape1;
#endif
#endif
};

struct ShadowRay {
    RayOrigin origin;
    RayDirection direction;
    vec3 radiance;  // [W/(m^2 sr)], of the light that the ray would find; 0: there is no ray
};

vec3 eval_bsdf(VisiblePoint point, vec3 to_light) {
    vec3 value = point.diffuse.albedo / PI;
#ifdef LOBES
    vec3 normal = raised_normal(point.shading.normal, point.facing.normal, point.to_viewer);
    value += eval_lobe(point.lobe0, point.shape0, normal, point.to_viewer, to_light);
#ifdef TWO_LOBES
    value += eval_lobe(point.lobe1, point.shape1, normal, point.to_viewer, to_light);
#endif
#endif
    return value;
}

// Which light a point's shadow ray of this number goes to, and how many such lights it stands for.
int light_of(int number, out float times) {
    times = 1.0;
#ifdef DRAWN
    uint dimension = DIMENSION_CHOICE + uint(depth) * 0x10000u;
    float u = random4(seed, pass_index, uint(pixel(source_element())), dimension).x;
    int chosen = choose_light((float(number) + u) / float(SHADOW_RAYS));
    times = 1.0 / (float(SHADOW_RAYS) * light_at(chosen).chosen);
    return chosen;
#else
    return number;
#endif
}

ShadowRay shadow_ray(VisiblePoint point, int number) {
    ShadowRay none = ShadowRay(RayOrigin(vec3(0.0), 0.0), RayDirection(vec3(0.0), 0.0), vec3(0.0));
    float times;
    int chosen = light_of(number, times);
    uint dimension = DIMENSION_DIRECT + uint(depth) * 0x10000u + uint(number);  // one may be chosen twice
    vec2 u = random4(seed, pass_index, uint(pixel(source_element())), dimension).xy;
    LightSample found = sample_light(light_at(chosen), point.place.position, u);
    float cosine = dot(found.to_light, point.shading.normal);
    if (cosine <= 0.0 || dot(found.to_light, point.facing.normal) <= 0.0 || found.share <= 0.0) return none;
    vec3 radiance = found.irradiance * (found.share * cosine * eval_bsdf(point, found.to_light));
    radiance *= times;
    if (!(largest(radiance) > 0.0)) return none;
    vec3 origin = offset_origin(point.place.position, point.facing.normal, found.to_light);
    // Ends short of the light, so that a light on a surface is not hidden by it: by what the origin
    // was lifted, and as much again for the rounding of the light and of the surface.
    float far = found.far - 2.0 * distance(origin, point.place.position);
    return ShadowRay(RayOrigin(origin, point.shading.triangle), RayDirection(found.to_light, far), radiance);
}
