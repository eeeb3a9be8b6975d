// SPDX-License-Identifier: GPL-3.0-or-later
// What a light would send to a visible point and on to the viewer, and the shadow ray that decides.
#include "lib/rng.glsl"
#include "lib/even.glsl"
#include "lib/visible_lobes.glsl"
#include "lib/offset.glsl"
#ifdef SMOOTH
#include "lib/terminator.glsl"
#endif
#ifdef TWO_SIDED
#include "lib/two_sided.glsl"
#endif
#ifdef LINKED
#include "lib/linked.glsl"
#endif

struct ShadowRay {
    RayOrigin origin;
    RayDirection direction;
    vec3 radiance;  // [W/(m^2 sr)], of the light that the ray would find; 0: there is no ray
    float lux;      // illuminance of diffuse surfaces by it
#ifdef PANES
    vec3 behind;    // of the radiance what rays of lobes do not find if light comes through glass
#endif
#if defined(SHADED_LAMPS) || defined(MEDIA)
    bool is_to_world;
#endif
};

ShadowRay no_shadow_ray() {
    ShadowRay none;
    none.origin = RayOrigin(vec3(0.0), 0.0);
    none.direction = RayDirection(vec3(0.0), 0.0);
    none.radiance = vec3(0.0);
    none.lux = 0.0;
#ifdef PANES
    none.behind = vec3(0.0);
#endif
#if defined(SHADED_LAMPS) || defined(MEDIA)
    none.is_to_world = false;
#endif
    return none;
}

bool is_ray(ShadowRay ray) { return largest(ray.radiance) > 0.0 || ray.lux > 0.0; }

// The normal by which lights are drawn; 0 in a medium, where they come from all sides.
vec3 normal_for_lights(VisiblePoint point) {
#ifdef SCATTERING
    if (is_in_medium(point.place)) return vec3(0.0);
#endif
    return point.facing.normal;
}

#ifdef PORTALS
// Whether shadow rays of this number go to the only world: one of the lights' own, and world_rays - 1 below 0.
bool goes_to_world(int number) {
#ifdef DRAWN
    if (number >= 0 && number < asked_lights) number = int(light_place_at(number).light);
    else if (number >= 0) return false;
#endif
    return number < 0 || number == world_light;
}
#endif

// Which light a point's shadow ray of this number goes to, and how many of them do in the mean.
int light_of(VisiblePoint point, int number, out float rays) {
    rays = 1.0;
#ifdef PORTALS
    if (goes_to_world(number)) {
        rays = float(world_rays);
        return world_light;
    }
#endif
#ifdef DRAWN
    if (number < asked_lights) return int(light_place_at(number).light);
    float u = even_over_passes(DIMENSION_CHOICE + uint(depth) * 0x10000u).x;
    u = (float(number - asked_lights) + u) / float(DRAWN);
    Drawn drawn = draw_light(point.place.position, normal_for_lights(point), u);
    rays = float(DRAWN) * drawn.probability;
    return drawn.light;
#else
    return number;
#endif
}

#ifdef TWO_SIDED
// Of an even pass and the next one, which one is up to chance, one is by the light from behind.
bool is_for_behind(uint dimension) {
    uint pair = 0x80000000u + (pass_index >> 1u);
    float chance = random4(seed, pair, uint(pixel_number(load_pixel().at)), dimension).y;
    return (chance < 0.5) != ((pass_index & 1u) == 0u);
}

// The same place for light that comes from behind, which has nothing but what lobes let through.
VisiblePoint from_behind(VisiblePoint point) {
    point.facing.normal = -point.facing.normal;
    point.shading.normal = -point.shading.normal;
    point.base = -point.base;
    point.diffuse.albedo = vec3(0.0);
    return point;
}
#endif

// What a shadow ray finds on a light.
struct ShadowSample {
    LightSample found;
    float own;        // density there of rays to the light [1/sr]; 0 where nothing asks for it: it is long to compile
    float to_gather;  // of those that what gathers photons would send; below 0: none gathers
};

#ifdef SCATTERING
// Of the lobe of a point in a medium.
float pdf_by_phase(VisiblePoint point, vec3 to_light) {
    return pdf_phase(point.lobe0, point.shape0, point.shading.normal, point.to_viewer, to_light);
}

// A direction alone by it.
LightSample around_by_phase(VisiblePoint point, vec2 u) {
    vec3 weight, to_light = sample_phase(point.lobe0, point.shape0, point.shading.normal, point.to_viewer, u, weight);
    return LightSample(to_light, T_MAX, vec3(0.0), 1.0);
}
#endif

// By which random numbers a shadow ray is drawn: which of so many rays to one light it is.
struct RayNumbers { uint dimension; uint which; uint many; };

RayNumbers numbers_of(int number) {
    RayNumbers ray = RayNumbers(uint(number), 0u, 1u);  // one light may be chosen twice
#ifdef PORTALS
    if (goes_to_world(number)) ray = RayNumbers(uint(world_light), uint(max(-number, 0)), uint(world_rays));
#endif
    ray.dimension += DIMENSION_DIRECT + uint(depth) * 0x10000u;
    return ray;
}

vec2 drawn_by(RayNumbers ray, uint further) { return even_over_passes(ray.dimension + further, ray.which, ray.many); }

// Of the shadow ray of these numbers. `by_lobe`: one more to the world, whose share is 0 where lobes ask for none.
ShadowSample sample_for(VisiblePoint point, Light light, RayNumbers ray, bool by_lobe, bool one_sided) {
    vec3 position = point.place.position, facing = point.facing.normal;
    ShadowSample made = ShadowSample(LightSample(vec3(0.0), 0.0, vec3(0.0), 0.0), 0.0, -1.0);
    bool by_portal = false, is_around = false;
#ifdef SCATTERING
    // Of the world about a point in a medium: half by what that scatters, else by the world's own density of either half
    // space. That by the cosine alone would have samples without bound.
    is_around = is_in_medium(point.place) && is_world(light);
    uint pixel = uint(pixel_number(load_pixel().at));
    float way = random4(seed, pass_index + ray.which * MOST_PASSES, pixel, ray.dimension).z;
    if (is_around && way < 0.25) facing = -facing;
#endif
#ifdef SHADOW_RAYS_BY_LOBES
    float first = is_world(light) && one_sided ? share_of_first_to_gather(point) : -1.0;
    if (by_lobe && first < 0.0) return made;
    if (by_lobe) {
        made.found = sample_to_gather(point, first, drawn_by(ray, 0x8000u));
    } else {
        made.found = sample_asked(light, position, facing, drawn_by(ray, 0u), by_portal);
    }
    if (first >= 0.0) made.to_gather = pdf_to_gather(point, first, made.found.to_light);
#else
    made.found = sample_asked(light, position, facing, drawn_by(ray, 0u), by_portal);
#endif
#ifdef SCATTERING
    if (is_around) {
        if (way >= 0.5) made.found = around_by_phase(point, drawn_by(ray, 0u));
        else if (!(dot(made.found.to_light, facing) > 0.0)) made.found.share = 0.0;
        if (dot(made.found.to_light, facing) < 0.0) facing = -facing;
    }
#endif
    bool has_own = by_portal || is_around || made.to_gather >= 0.0;
#ifdef WEIGHED
    has_own = has_own || rays_of_lobes_find(light);
#endif
    if (has_own) made.own = pdf_asked(light, position, facing, made.found.to_light);
    if (by_lobe || by_portal || is_around) {
        float density = by_lobe ? made.to_gather : made.own;
#ifdef SCATTERING
        if (is_around) density = 0.25 * density + 0.5 * pdf_by_phase(point, made.found.to_light);
#endif
        if (!(density > 0.0)) made.found.share = 0.0;
        else made.found.irradiance = seen_light(light, position, made.found.to_light, T_MAX).rgb / density;
    }
    return made;
}

#ifdef LOBES
// What the point's lobes reflect of the light that so many such rays find, times their cosines.
vec3 reflected_by_lobes(VisiblePoint point, Light light, ShadowSample made, float rays, bool by_lobe) {
    float own = 0.0, part = 1.0;
    if (made.to_gather >= 0.0) {
        part = (by_lobe ? made.to_gather : made.own) / max(made.own + made.to_gather, 1.0e-30);
    }
#ifdef WEIGHED
    if (rays_of_lobes_find(light)) own = rays * made.own;
#endif
    return eval_lobes(point, light, own, made.found.to_light, part, by_lobe);
}
#endif

// How high above the triangle a shadow ray begins, as on the smooth surface, whose terminator is not the triangles';
// below 0: it would go into what is below.
float lift_towards(VisiblePoint point, vec3 to_light) {
#ifdef SCATTERING
    if (is_in_medium(point.place)) return 0.0;
#endif
    float above = dot(to_light, point.facing.normal);
#ifdef SMOOTH
    int triangle = int(point.shading.triangle);
    float lift = 0.0, terminator = terminator_share(triangle, dot(to_light, point.base), above);
    if (terminator > 0.0) lift = height_to_smooth(triangle, point.place.position, point.base);
    return above <= 0.0 && lift <= 0.0 ? -1.0 : lift * terminator;
#else
    return above <= 0.0 ? -1.0 : 0.0;
#endif
}

// The ray from a point, lifted, to what was found on a light.
ShadowRay ray_to(VisiblePoint point, LightSample found, float lift) {
    vec3 origin = offset_origin(point.place.position, point.facing.normal, point.facing.normal);
    origin += lift * point.base;
    // Ends short of the light, so that a light on a surface is not hidden by it: by what the origin
    // was lifted, and as much again for the rounding of the light and of the surface.
    float far = found.far - 2.0 * distance(origin, point.place.position);
    vec3 direction = found.to_light;
    float source = point.shading.triangle;
#ifdef SMOOTH
    // From above a triangle that turns away from the light, it may meet that one, too.
    if (lift > 0.0 && dot(direction, point.facing.normal) <= 0.0) source = NO_TRIANGLE;
    if (lift > 0.0 && found.far < T_MAX) {
        // From as high as that it goes to the same place on the light, in another direction.
        vec3 to_place = point.place.position + found.to_light * found.far - origin;
        direction = to_place / max(length(to_place), 1.0e-30);
        far = length(to_place) - 2.0 * SURFACE_OFFSET;
    }
#endif
    ShadowRay ray = no_shadow_ray();
    ray.origin = RayOrigin(origin, source);
    ray.direction = RayDirection(direction, far);
    return ray;
}

// A point's shadow ray of this number; `by_lobe`: the second one to the world.
ShadowRay shadow_ray(VisiblePoint point, int number, bool by_lobe) {
    ShadowRay none = no_shadow_ray();
    RayNumbers numbers = numbers_of(number);
    bool one_sided = true;
#ifdef DRAWN
    if (by_lobe && number >= asked_lights) return none;  // the world is asked
#endif
#ifdef TWO_SIDED
    float share_of_rays = share_of_side(int(point.shading.triangle));
    one_sided = !(share_of_rays < 1.0);
    if (!one_sided && is_for_behind(numbers.dimension)) point = from_behind(point);
#endif
    float rays;
    int chosen = light_of(point, number, rays);
    if (!(rays > 0.0)) return none;
#ifdef TWO_SIDED
    rays *= share_of_rays;
#endif
    Light light = light_at(chosen);
#ifdef LINKED
    if (!lights_surface(light, surface_number(point.place))) return none;
#endif
#ifdef VISIBILITY
    LightLimit limit = light_limit_at(chosen);
    if (point.bounces > limit.bounces) return none;
#endif
    ShadowSample made = sample_for(point, light, numbers, by_lobe, one_sided);
    LightSample found = made.found;
#ifdef SCATTERING
    if (is_in_medium(point.place)) point.facing.normal *= dot(found.to_light, point.facing.normal) < 0.0 ? -1.0 : 1.0;
#endif
    float cosine = cosine_of_diffuse(point, found.to_light), any_cosine = cosine;
#ifdef LOBES
    float of_lobes = most_cosine_of_lobes(point, found.to_light);
    any_cosine += of_lobes;
#endif
    if (any_cosine <= 0.0 || found.share <= 0.0) return none;
    float lift = lift_towards(point, found.to_light);
    if (lift < 0.0) return none;
    float share = found.share * share_by_nodes(light, found.to_light, found.far);
    vec3 irradiance = found.irradiance * (share / rays), radiance = vec3(0.0);
    irradiance *= colour_by_nodes(light, point.place.position + found.far * found.to_light, -found.to_light);
    float lux = 0.0;
    if (!by_lobe && is_found(light, BY_DIFFUSE)) {
        radiance = irradiance * point.diffuse.albedo * (cosine / PI);
#ifdef ILLUMINANCE
        if (is_diffuse(point.diffuse)) lux = lux_of(irradiance * cosine);
#endif
    }
#ifdef PANES
    vec3 behind = radiance;
#endif
#ifdef LOBES
    if (of_lobes > 0.0) {
        radiance += irradiance * reflected_by_lobes(point, light, made, rays, by_lobe);
#ifdef PANES
        behind += irradiance * not_of_rays;
#endif
    }
#endif
    if (!(largest(radiance) > 0.0 || lux > 0.0)) return none;
    ShadowRay ray = ray_to(point, found, lift);
    ray.radiance = radiance;
    ray.lux = lux;
#ifdef PANES
    ray.behind = behind;
#endif
#if defined(SHADED_LAMPS) || defined(MEDIA)
    ray.is_to_world = is_world(light);
#endif
#ifdef VISIBILITY
    if (!(limit.shadowed > 0.0)) ray.direction.t_max = 0.0;  // nothing is in its way
#endif
    return ray;
}
