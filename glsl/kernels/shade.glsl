// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluate the material where a ray ends: where that is, and what it reflects there. Nothing after it looks
// a material up.
#include "lib/surface.glsl"
#include "lib/place.glsl"
#include "lib/diffuse.glsl"
#ifdef PROGRAMS
#include "lib/program.glsl"
#endif
#ifdef LOBES
#include "lib/material_lobes.glsl"
#endif
#ifdef TANGENTS
#include "lib/tangent.glsl"
#endif
#ifdef VISIBILITY
#include "lib/visibility.glsl"
#endif
#ifdef EYE
#include "lib/bounces.glsl"
#endif
#ifdef SCATTERING
#include "lib/scattering_point.glsl"
#endif
#ifdef WALKS
#include "lib/reach.glsl"
#endif

#ifdef EYE
#ifdef VISIBILITY
// Mirrors show what is there.
bool is_held_out(Surface surface, Material material) {
    return bounces_before() == 0.0 && (material.holdout > 0.0 || (visibility_of(surface.surface) & HOLDOUT) != 0);
}

#ifdef LOBES
// Leave nothing of a lobe but what goes straight on; how much that is.
float left_straight(inout Lobe lobe, Shape shape, float cosine) {
#ifdef TRANSPARENT
    if (is_transparent(lobe)) return mean(albedo_lobe(lobe, shape, cosine));
#endif
    lobe = Lobe(vec3(0.0), 0.0);
    return 0.0;
}
#endif
#endif
#endif

// The surface's material, with what its program gives here.
Material material_of(Hit hit, vec3 direction, Surface surface) {
    Material material = material_at(surface.material);
#ifdef PROGRAMS
    shading_point = shading_point_at(hit, direction, surface);
#if defined(PHOTONS)
    ask_as_light();
#elif defined(EYE)
    ask_as_eye_ray();
#endif
    run_program(material);
    material.albedo = reflectance_from(material.albedo_from, material.albedo);
#endif
    return material;
}

void kernel() {
    Hit hit = load_hit();
    if (!is_hit(hit)) skip();
    vec3 direction = load_direction().direction;
#ifdef SCATTERING
    if (is_scattered(hit)) {
        write_scattering_point(hit, direction);
        return;
    }
#endif
    float let_through = 0.0;  // by what is held out
    Surface surface = surface_at(hit, direction);
    Material material = material_of(hit, direction, surface);
#ifdef NORMALS
    vec3 base = normal_from(material.base_from, surface.shading);
    surface.shading = normal_from(material.normal_from, base);
#endif
    Facing facing = Facing(surface.geometric, surface.side);
    Shading shading = Shading(surface.shading, float(hit_triangle(hit)));
#ifdef LOBES
#ifdef DISPERSION
    set_wavelength();
#endif
    float turn = 0.0;
    vec3 raised = raised_normal(surface.shading, surface.geometric, -direction);
#ifdef TANGENTS
    turn = tangent_angle(hit, raised);
#endif
#ifdef EYE
    Lobes lobes = lobes_of(material, Aspect(raised, surface.geometric, -direction), turn, surface.side);
#ifdef VISIBILITY
    if (is_held_out(surface, material)) {
        float cosine = max(0.0, -dot(direction, raised));
        let_through += left_straight(lobes.lobe0, lobes.shape0, cosine);
        let_through += left_straight(lobes.lobe1, lobes.shape1, cosine);
    }
#endif
#else
    Lobes lobes = lobes_of(material, surface.position, facing, shading, -direction, turn);
#endif
#ifdef WALKS
    if (is_exit(load_direction().t_max)) {
        lobes = no_lobes();
        lobes.diffuse = bare_diffuse(vec3(1.0));
    }
#endif
    Diffuse diffuse = lobes.diffuse;
#ifdef GATHERED_LOBES
    bool has_broad = gathered_share(lobes.lobe0, lobes.shape0) + gathered_share(lobes.lobe1, lobes.shape1) > 0.0;
    if (has_broad) diffuse = with_photons(diffuse);
#endif
    store_lobe0(lobes.lobe0);
    store_shape0(lobes.shape0);
#ifdef TWO_LOBES
    store_lobe1(lobes.lobe1);
    store_shape1(lobes.shape1);
#endif
#else
    Diffuse diffuse = bare_diffuse(material.albedo);
#endif
#ifndef EYE
    diffuse = with_photons(diffuse, (surface.flags & PHOTONS_LAND) != 0);
#endif
#ifdef NORMALS
    if (is_given(material.base_from)) diffuse = with_base(diffuse, base, surface.shading);
#endif
    store_place(Place(surface.position, stored_surface(surface.surface, surface.side)));
    store_facing(facing);
    store_shading(shading);
#ifdef EYE
#ifdef VISIBILITY
    if (is_held_out(surface, material)) diffuse = held_out(let_through);
#endif
#endif
    store_diffuse(diffuse);
}
