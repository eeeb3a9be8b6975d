// SPDX-License-Identifier: GPL-3.0-or-later
// What a light would send to a visible point and on to the viewer, and the shadow ray that decides.
#include "lib/rng.glsl"
#include "lib/even.glsl"
#include "lib/asked_lights.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#include "lib/offset.glsl"
#ifdef LOBES
#include "lib/gathered.glsl"
#endif
#ifdef SMOOTH
#include "lib/terminator.glsl"
#endif
#ifdef NORMALS
#include "lib/base_normal.glsl"
#include "lib/bump_shadowing.glsl"
#endif
#ifdef TWO_SIDED
#include "lib/two_sided.glsl"
#endif

struct VisiblePoint {
    Place place;
    Facing facing;
    Shading shading;
    Diffuse diffuse;
    vec3 to_viewer;
    vec3 base;  // normal of the smooth surface, about which the shading normal may be bent
    float bounces;  // of lobes, that the ray to it has behind it
    float passed;   // transparent surfaces that it has passed: a shadow ray has what is left
#ifdef LOBES
    vec3 raised;  // normal of the lobes
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
    float lux;      // illuminance of diffuse surfaces by it
#ifdef PANES
    vec3 behind;    // of the radiance what rays of lobes do not find if light comes through glass
#endif
#ifdef SHADED_LAMPS
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
#ifdef SHADED_LAMPS
    none.is_to_world = false;
#endif
    return none;
}

bool is_ray(ShadowRay ray) { return largest(ray.radiance) > 0.0 || ray.lux > 0.0; }

#ifdef WEIGHED
// Of a lobe, of which rays that find the light as well have a part.
float part_of_shadow_rays(float own, float density, Lobe lobe, Shape shape) {
    float by_rays = 1.0;
#ifdef GATHERED_LOBES
    by_rays -= gathered_share(lobe, shape);
#endif
    return 1.0 - by_rays + by_rays * (own / (own + density));
}
#endif

// The cosine to a light of Lambert's lobe, or what stands for it.
float cosine_of_diffuse(VisiblePoint point, vec3 to_light) {
    float cosine = max(0.0, dot(to_light, point.shading.normal));
#ifdef NORMALS
    cosine *= bump_shadowing(point.base, point.shading.normal, to_light);
#endif
    return cosine;
}

#ifdef LOBES
// Whether the light comes from behind, seen from the viewer.
bool is_behind(VisiblePoint point) {
#ifdef TWO_SIDED
    return dot(point.to_viewer, point.facing.normal) < 0.0;
#else
    return false;
#endif
}

// The cosine of the other lobes.
float cosine_of_lobes(VisiblePoint point, vec3 to_light) {
    float cosine = dot(to_light, point.raised);
#ifdef NORMALS
    if (leaks(point.base, point.raised, to_light)) return 0.0;
#endif
    return max(0.0, is_behind(point) ? -cosine : cosine);
}

#ifdef SHADOW_RAYS_BY_LOBES
// What gathers photons sends no rays, and by the cosine few shadow rays to the world would go where it reflects most. So
// a second one goes where such a lobe sends it. Each ray of the two has its part by the balance heuristic.

// With which probability that is the point's first lobe; below 0: it has none that gathers.
float share_of_first_to_gather(VisiblePoint point) {
    float first = gathered_share(point.lobe0, point.shape0), second = 0.0;
#ifdef TWO_LOBES
    second = gathered_share(point.lobe1, point.shape1);
#endif
    return first + second > 0.0 ? first / (first + second) : -1.0;
}

float pdf_to_gather(VisiblePoint point, float first, vec3 to_light) {
    float density = first * pdf_lobe(point.lobe0, point.shape0, point.raised, point.to_viewer, to_light);
#ifdef TWO_LOBES
    if (first < 1.0) density += (1.0 - first) * pdf_lobe(point.lobe1, point.shape1, point.raised, point.to_viewer, to_light);
#endif
    return density;
}

// A direction alone: its share is 0 if there is none.
LightSample sample_to_gather(VisiblePoint point, float first, vec2 u) {
    LightSample found = LightSample(point.raised, T_MAX, vec3(0.0), 0.0);
    Lobe lobe = point.lobe0;
    Shape shape = point.shape0;
#ifdef TWO_LOBES
    if (u.x >= first) {
        lobe = point.lobe1;
        shape = point.shape1;
        u.x = (u.x - first) / (1.0 - first);
    } else {
        u.x /= first;
    }
#endif
    vec3 weight;
    found.to_light = sample_lobe(lobe, shape, point.raised, point.to_viewer, u, weight);
    if (largest(weight) > 0.0) found.share = 1.0;
    return found;
}
#endif

#ifdef PANES
vec3 not_of_rays;  // of what eval_lobes gave last, which no ray of a lobe finds
#endif

// Whether shadow rays find a light for a lobe. Those of diffuse lobes are diffuse rays, but where rays of lobes alone find
// the light they do, whatever their lobe is.
bool is_found_for(Light light, Lobe lobe) {
    if (!is_diffuse_kind(lobe.kind)) return is_found(light, BY_GLOSSY);
    return is_found(light, BY_DIFFUSE) && (is_found(light, BY_GLOSSY) || !is_found(light, BY_CHAINS));
}

// What a point's lobes reflect of a light. Where rays of a lobe may find the light as well, this is the part of
// shadow rays of this density by the balance heuristic (Veach 1997, sec. 9.2); the kernel emitted has the other. `part`:
// of what gathers photons, by this ray, and nothing else if it goes by it.
vec3 eval_lobes(VisiblePoint point, Light light, float own, vec3 to_light, float part, bool by_lobe) {
    vec3 normal = point.raised, sum = vec3(0.0);
#ifdef PANES
    not_of_rays = vec3(0.0);
#endif
    int lobes = 1;
    float share = 1.0;  // of the first lobe, of the point's rays
#ifdef TWO_LOBES
    if (is_lobe(point.lobe1)) lobes = 2;
#endif
#ifdef WEIGHED
    bool is_weighed = own > 0.0 && point.bounces < float(chain_depth);
#ifdef TWO_LOBES
    float cosine = dot(point.to_viewer, point.shading.normal);
    cosine = max(0.0, is_behind(point) ? -cosine : cosine);
    Shape rays0 = shape_of_rays(point.lobe0, point.shape0), rays1 = shape_of_rays(point.lobe1, point.shape1);
    if (is_weighed && lobes > 1) share = share_of_first(point.lobe0, rays0, point.lobe1, rays1, cosine);
#endif
#endif
    // A loop, for compilers write out each call.
    for (int i = 0; i < lobes; i++) {
        Lobe lobe = point.lobe0;
        Shape shape = point.shape0;
#ifdef TWO_LOBES
        if (i > 0) {
            lobe = point.lobe1;
            shape = point.shape1;
            share = 1.0 - share;
        }
#endif
#ifdef TWO_SIDED
        if (is_behind(point) && !transmits_kind(lobe.kind)) continue;
#endif
        if (!is_found_for(light, lobe)) continue;
        vec3 reflected = eval_lobe(lobe, shape, normal, point.to_viewer, to_light);
        float counts = 1.0;
#ifdef WEIGHED
        if (is_weighed) {
            float density = pdf_lobe(lobe, shape, normal, point.to_viewer, to_light);
            counts = part_of_shadow_rays(own, share * density, lobe, shape);
        }
#endif
#ifdef SHADOW_RAYS_BY_LOBES
        float gathered = gathered_share(lobe, shape);
        counts = gathered * part + (by_lobe ? 0.0 : counts - gathered);
#endif
        sum += counts * reflected;
#ifdef PANES
#ifdef WEIGHED
        if (is_weighed) {
#ifdef GATHERED_LOBES
            counts = min(counts, gathered_share(lobe, shape) * part);
#else
            counts = 0.0;
#endif
        }
#endif
        not_of_rays += counts * reflected;
#endif
    }
    return sum;
}
#endif

// Which light a point's shadow ray of this number goes to, and how many of them do in the mean.
int light_of(VisiblePoint point, int number, out float rays) {
    rays = 1.0;
#ifdef DRAWN
    if (number < asked_lights) return int(light_place_at(number).light);
    float u = even_over_passes(DIMENSION_CHOICE + uint(depth) * 0x10000u).x;
    u = (float(number - asked_lights) + u) / float(DRAWN);
    Drawn drawn = draw_light(point.place.position, point.facing.normal, u);
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

// Of the shadow ray of this dimension. `by_lobe`: the second one to the world, whose share is 0 where lobes ask for none.
ShadowSample sample_for(VisiblePoint point, Light light, uint dimension, bool by_lobe, bool one_sided) {
    vec3 position = point.place.position, facing = point.facing.normal;
    ShadowSample made = ShadowSample(LightSample(vec3(0.0), 0.0, vec3(0.0), 0.0), 0.0, -1.0);
    bool by_portal = false;
#ifdef SHADOW_RAYS_BY_LOBES
    float first = is_world(light) && one_sided ? share_of_first_to_gather(point) : -1.0;
    if (by_lobe && first < 0.0) return made;
    if (by_lobe) {
        made.found = sample_to_gather(point, first, even_over_passes(dimension + 0x8000u));
    } else {
        made.found = sample_asked(light, position, facing, even_over_passes(dimension), by_portal);
    }
    if (first >= 0.0) made.to_gather = pdf_to_gather(point, first, made.found.to_light);
#else
    made.found = sample_asked(light, position, facing, even_over_passes(dimension), by_portal);
#endif
    bool has_own = by_portal || made.to_gather >= 0.0;
#ifdef WEIGHED
    has_own = has_own || rays_of_lobes_find(light);
#endif
    if (has_own) made.own = pdf_asked(light, position, facing, made.found.to_light);
    if (by_lobe || by_portal) {
        float density = by_lobe ? made.to_gather : made.own;
        if (!(density > 0.0)) made.found.share = 0.0;
        else made.found.irradiance = seen_light(light, position, made.found.to_light, T_MAX).rgb / density;
    }
    return made;
}

#ifdef LOBES
// What the point's lobes reflect of the light that so many such rays find.
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
#ifdef SMOOTH
    if (lift > 0.0 && found.far < T_MAX) {
        // From as high as that it goes to the same place on the light, in another direction.
        vec3 to_place = point.place.position + found.to_light * found.far - origin;
        direction = to_place / max(length(to_place), 1.0e-30);
        far = length(to_place) - 2.0 * SURFACE_OFFSET;
    }
#endif
    ShadowRay ray = no_shadow_ray();
    ray.origin = RayOrigin(origin, point.shading.triangle);
    ray.direction = RayDirection(direction, far);
    return ray;
}

// A point's shadow ray of this number; `by_lobe`: the second one to the world.
ShadowRay shadow_ray(VisiblePoint point, int number, bool by_lobe) {
    ShadowRay none = no_shadow_ray();
    uint dimension = DIMENSION_DIRECT + uint(depth) * 0x10000u + uint(number);  // one may be chosen twice
    bool one_sided = true;
#ifdef DRAWN
    if (by_lobe && number >= asked_lights) return none;  // the world is asked
#endif
#ifdef TWO_SIDED
    float share_of_rays = share_of_side(int(point.shading.triangle));
    one_sided = !(share_of_rays < 1.0);
    if (!one_sided && is_for_behind(dimension)) point = from_behind(point);
#endif
    float rays;
    int chosen = light_of(point, number, rays);
    if (!(rays > 0.0)) return none;
#ifdef TWO_SIDED
    rays *= share_of_rays;
#endif
    Light light = light_at(chosen);
#ifdef VISIBILITY
    LightLimit limit = light_limit_at(chosen);
    if (point.bounces > limit.bounces) return none;
#endif
    ShadowSample made = sample_for(point, light, dimension, by_lobe, one_sided);
    LightSample found = made.found;
    float cosine = cosine_of_diffuse(point, found.to_light), any_cosine = cosine;
#ifdef LOBES
    float of_lobes = cosine_of_lobes(point, found.to_light);
    any_cosine += of_lobes;
#endif
    if (any_cosine <= 0.0 || found.share <= 0.0) return none;
    float lift = lift_towards(point, found.to_light);
    if (lift < 0.0) return none;
    float share = found.share * share_by_nodes(light, found.to_light, found.far);
    vec3 irradiance = found.irradiance * (share / rays), radiance = vec3(0.0);
#ifdef GOBOS
    irradiance *= gobo_colour(light, point.place.position + found.far * found.to_light, -found.to_light);
#endif
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
        radiance += irradiance * of_lobes * reflected_by_lobes(point, light, made, rays, by_lobe);
#ifdef PANES
        behind += irradiance * of_lobes * not_of_rays;
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
#ifdef SHADED_LAMPS
    ray.is_to_world = is_world(light);
#endif
#ifdef VISIBILITY
    if (!(limit.shadowed > 0.0)) ray.direction.t_max = 0.0;  // nothing is in its way
#endif
    return ray;
}
