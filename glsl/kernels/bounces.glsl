// SPDX-License-Identifier: GPL-3.0-or-later
// Several bounces of each photon, a thread a photon: tracer, shade, projector and reflector one after the
// other, with registers for streams. A GPU takes longer to launch them one by one than to run them.
#define kernel trace_photon
#include "kernels/tracer.glsl"
#undef kernel
#ifdef SCATTERING
#define kernel fly_photon
#include "kernels/free_flight.glsl"
#undef kernel
#endif
#define kernel shade_photon
#include "kernels/shade.glsl"
#undef kernel
#define kernel project_photon
#include "kernels/projector.glsl"
#undef kernel
#define kernel reflect_photon
#include "kernels/reflector.glsl"
#undef kernel
layout(std430, binding = 0) buffer Alive { uint alive[]; };
layout(rgba32f, binding = 0) writeonly uniform image2D end_origin;
layout(rgba32f, binding = 1) writeonly uniform image2D end_direction;
layout(rgba32f, binding = 2) writeonly uniform image2D end_flux;
layout(rgba32f, binding = 3) writeonly uniform image2D places;  // a bounce's above those of the one before
layout(rgba32f, binding = 4) writeonly uniform image2D deposits;
#ifdef CAUSTICS
layout(rgba32f, binding = 5) writeonly uniform image2D caustics;
#endif
#ifdef MEDIA
#ifdef CAUSTICS
layout(rgba32f, binding = 6) writeonly uniform image2D end_medium;
#else
layout(rgba32f, binding = 5) writeonly uniform image2D end_medium;
#endif
uniform sampler2D begin_medium;
#endif
uniform sampler2D begin_origin;
uniform sampler2D begin_direction;
uniform sampler2D begin_flux;
uniform int alive_slot;
uniform int first_bounce;
uniform int bounces;
uniform int first_to_deposit;  // bounce
shared uint group_alive;

// Whether the photon reaches a kernel's end.
#ifdef SCATTERING
bool is_hit_by_ray() {
    store_hit(Hit(0.0, 0.0, 0.0, 0.0));
    trace_photon();
    fly_photon();
    store_hit(load_met());
    store_medium(load_along());
    store_flux(load_carried());
    return is_hit(load_met());
}
#else
bool is_hit_by_ray() { skipped = false; trace_photon(); return !skipped; }
#endif
bool is_shaded() { skipped = false; shade_photon(); return !skipped; }
bool is_deposited() { skipped = false; project_photon(); return !skipped; }
bool is_reflected() { skipped = false; reflect_photon(); return !skipped; }

void main() {
    if (gl_LocalInvocationIndex == 0u) group_alive = 0u;
    barrier();
    ivec2 size = textureSize(begin_origin, 0), at = ivec2(thread() % size.x, thread() / size.x);
    if (thread() < count) {
        store_origin(unpack_RayOrigin(texelFetch(begin_origin, at, 0)));
        store_direction(unpack_RayDirection(texelFetch(begin_direction, at, 0)));
        store_flux(unpack_Flux(texelFetch(begin_flux, at, 0)));
#ifdef MEDIA
        store_medium(unpack_Medium(texelFetch(begin_medium, at, 0)));
#endif
        bool lives = any(notEqual(load_direction().direction, vec3(0.0)));
        for (int i = 0; i < bounces; i++) {
            vec4 place = vec4(0.0), deposit = vec4(0.0), caustic = vec4(0.0);
            bounce = first_bounce + i;
            if (lives) {
                lives = is_hit_by_ray() && is_shaded();
                if (lives && bounce >= first_to_deposit && is_deposited()) {
                    place = pack_Place(load_landed());
                    deposit = pack_Deposit(load_deposit());
#ifdef CAUSTICS
                    caustic = pack_Place(load_caustic());
#endif
                }
                lives = lives && is_reflected();
                store_origin(load_next_origin());
                store_direction(load_next_direction());
                store_flux(load_next_flux());
#ifdef MEDIA
                store_medium(load_next_medium());
#endif
            }
            imageStore(places, at + ivec2(0, i * size.y), place);
            imageStore(deposits, at + ivec2(0, i * size.y), deposit);
#ifdef CAUSTICS
            imageStore(caustics, at + ivec2(0, i * size.y), caustic);
#endif
        }
        vec4 none = vec4(0.0);
        imageStore(end_origin, at, lives ? pack_RayOrigin(load_origin()) : none);
        imageStore(end_direction, at, lives ? pack_RayDirection(load_direction()) : none);
        imageStore(end_flux, at, lives ? pack_Flux(load_flux()) : none);
#ifdef MEDIA
        imageStore(end_medium, at, lives ? pack_Medium(load_medium()) : none);
#endif
        if (lives) atomicAdd(group_alive, 1u);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u && group_alive > 0u) atomicAdd(alive[alive_slot], group_alive);
}
