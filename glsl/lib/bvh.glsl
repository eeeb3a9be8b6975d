// SPDX-License-Identifier: GPL-3.0-or-later
// Closest hit or any hit of a ray in the triangles, by a BVH2 with both children's boxes in a node
// (native/src/bvh writes these arrays). Uses the tables of nodes and triangles.
// Wider is not faster on GPUs, with eight children a node and their boxes in 8 bits, and storage buffers in
// place of textures would gain little.
#include "lib/constants.glsl"
#ifndef ONE_SURFACE
#ifdef VISIBILITY
#include "lib/visibility.glsl"
#endif
#endif
#ifdef BY_REACH
#include "lib/reach.glsl"
int rays_traced;
#else
#define rays_traced VISIBILITY
#endif
#ifdef ONE_SURFACE
float one_surface;  // which rays meet alone, whatever rays it is visible to
#endif

const int BVH_STACK = 64;  // the native build keeps every tree shallower
// Ize 2013, "Robust BVH Ray Traversal": 1 + 2 gamma(3) makes the slab test conservative.
const float SLAB_ROUNDING = 1.0000004;

#ifdef ANY_HIT
#ifdef TRANSPARENT
#include "lib/transmittance.glsl"
#include "lib/colour.glsl"
vec3 let_through;  // by the surfaces that the last ray has met
int most_passed;   // surfaces that a ray may pass
#endif
#endif

struct RayHit { float t; int triangle; float u; float v; };  // triangle -1: a miss

// Everything about a ray that the triangle test reuses.
struct ShearedRay { vec3 origin; int axis; vec3 shear; };

// The components of v with the ray's dominant axis last.
vec3 permute(vec3 v, int axis) { return axis == 0 ? v.yzx : (axis == 1 ? v.zxy : v.xyz); }

ShearedRay shear_ray(vec3 origin, vec3 direction) {
    vec3 a = abs(direction);
    int axis = a.x > a.y ? (a.x > a.z ? 0 : 2) : (a.y > a.z ? 1 : 2);
    vec3 d = permute(direction, axis);
    return ShearedRay(origin, axis, vec3(d.x / d.z, d.y / d.z, 1.0 / d.z));
}

// A ray's constants of the box test: planes are met at plane * inverse - low (or high).
struct Slabs { vec3 inverse; vec3 low; vec3 high; };

// The box is grown by `pad`: (low - pad) - origin = low - (origin + pad).
Slabs slabs_of(vec3 origin, vec3 inverse, float pad) {
    return Slabs(inverse, (origin + pad) * inverse, (origin - pad) * inverse);
}

// Distance at which the ray enters the box, or T_MAX if it misses it before t_max.
// Each step is monotonic, rounding included: a box about another is entered no later, and whenever the other is.
float enter_box(vec3 low, vec3 high, Slabs slabs, float t_max) {
    vec3 t0 = fma(low, slabs.inverse, -slabs.low), t1 = fma(high, slabs.inverse, -slabs.high);
    vec3 near = min(t0, t1), far = max(t0, t1);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    float leave = min(min(far.x, far.y), min(far.z, t_max)) * SLAB_ROUNDING;
    return enter <= leave ? enter : T_MAX;
}

// Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection". An edge function of exactly
// zero counts as inside for both neighbours, so no ray slips between them; `precise` forbids the
// fused multiply-adds that would let neighbours disagree about their common edge.
// The hit lies no nearer than where the ray enters the triangle's own box, as rounding may have it: the boxes
// about that one are then entered before t_max, too, and no tree loses it. `number` is the triangle's in the
// scene.
bool intersect_triangle(ShearedRay ray, Slabs slabs, int index, float t_max, out vec3 tuv, out float number) {
    Triangle corners = triangle_at(index);
    vec3 a = permute(corners.a - ray.origin, ray.axis);
    vec3 b = permute(corners.b - ray.origin, ray.axis);
    vec3 c = permute(corners.c - ray.origin, ray.axis);
    precise vec2 a2 = a.xy - ray.shear.xy * a.z;
    precise vec2 b2 = b.xy - ray.shear.xy * b.z;
    precise vec2 c2 = c.xy - ray.shear.xy * c.z;
    precise float u = c2.x * b2.y - c2.y * b2.x;
    precise float v = a2.x * c2.y - a2.y * c2.x;
    precise float w = b2.x * a2.y - b2.y * a2.x;
    tuv = vec3(0.0);
    number = corners.number;
    if (min(u, min(v, w)) < 0.0 && max(u, max(v, w)) > 0.0) return false;
    float det = u + v + w;
    if (det == 0.0) return false;
    float t = (u * a.z + v * b.z + w * c.z) * ray.shear.z / det;
    if (!(t > 0.0 && t <= t_max)) return false;
    vec3 low = min(min(corners.a, corners.b), corners.c), high = max(max(corners.a, corners.b), corners.c);
    t = max(t, enter_box(low, high, slabs, t_max));
    tuv = vec3(t, v / det, w / det);  // weights of the second and third corner
#if defined(ONE_SURFACE)
    if (corners.surface != one_surface) return false;
#elif defined(VISIBILITY)
    if ((visibility_of(corners.surface) & rays_traced) == 0) return false;
#endif
    return t <= t_max;
}

// 1 / d without infinities, which would meet zeros and make NaN.
float safe_inverse(float d) { return 1.0 / (abs(d) < 1.0e-20 ? (d < 0.0 ? -1.0e-20 : 1.0e-20) : d); }

// The nearest hit with 0 < t < t_max, not on triangle `source`, and of several there that of the triangle
// which is the first in the scene; with ANY_HIT, some hit.
// A ray that is not finite or has no direction misses.
RayHit trace(vec3 origin, vec3 direction, float t_max, int source) {
    RayHit best = RayHit(t_max, -1, 0.0, 0.0);
#ifdef BY_REACH
    rays_traced = rays_by_reach(t_max);
#endif
#ifdef ANY_HIT
#ifdef TRANSPARENT
    let_through = vec3(1.0);
    int passed = 0;
#endif
#endif
    float length2 = dot(direction, direction);
    float finite = dot(origin, vec3(1.0)) + length2;
    if (!(length2 > 0.0) || isnan(finite) || isinf(finite)) return best;
    ShearedRay ray = shear_ray(origin, direction);
    vec3 inverse = vec3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z));
    // The triangle test rounds relative to the origin's distance; a box must not be stricter.
    vec3 reach = abs(origin);
    float pad = 6.0e-7 + 1.2e-7 * max(reach.x, max(reach.y, reach.z));
    Slabs slabs = slabs_of(origin, inverse, pad);
    float first = 0.0;  // the number of the best hit's triangle
    int stack[BVH_STACK];
    int depth = 0;
    // Each step is of a node, once the triangles of the one before are looked at, and of one of its triangles: SIMD
    // neighbours wait for no leaf that has more of them (Aila & Laine 2009, "if-if").
    int node = 0, at = 0, in_leaves = 0, from_left = 0, first_left = 0, first_right = 0;
    float left_t = T_MAX, right_t = T_MAX;
    bool left_inner = false, right_inner = false, is_root = true;
    while (true) {
        if (at == in_leaves) {
            // Inner children are kept for later, but the nearer one.
            bool go_left = left_inner && left_t <= best.t, go_right = right_inner && right_t <= best.t;
            if (go_left && go_right) {
                bool left_first = left_t <= right_t;
                if (depth < BVH_STACK) stack[depth++] = left_first ? first_right : first_left;
                node = left_first ? first_left : first_right;
            } else if (go_left) {
                node = first_left;
            } else if (go_right) {
                node = first_right;
            } else if (depth > 0) {
                node = stack[--depth];
            } else if (!is_root) {
                return best;
            }
            is_root = false;
            Node both = node_at(node);
            left_t = enter_box(both.left_low, both.left_high, slabs, best.t);
            right_t = enter_box(both.right_low, both.right_high, slabs, best.t);
            int left_count = int(both.left_count), right_count = int(both.right_count);
            first_left = int(both.left_first);
            first_right = int(both.right_first);
            from_left = left_t < T_MAX ? left_count : 0;  // leaves at once, left before right
            in_leaves = from_left + (right_t < T_MAX ? right_count : 0);
            left_inner = left_count == 0 && left_t < T_MAX && first_left >= 0;
            right_inner = right_count == 0 && right_t < T_MAX && first_right >= 0;
            at = 0;
        }
        if (at < in_leaves) {
            int triangle = at < from_left ? first_left + at : first_right + at - from_left;
            at++;
            vec3 tuv;
            float number;
            if (triangle != source && intersect_triangle(ray, slabs, triangle, best.t, tuv, number)
                && (tuv.x < best.t || (best.triangle >= 0 && number < first))) {
#ifdef ANY_HIT
#ifdef TRANSPARENT
                // In whatever order it meets them: the product is the same.
                let_through *= transmittance_at(Hit(tuv.x, stored_triangle(triangle), tuv.y, tuv.z), direction);
                if (largest(let_through) > 0.0 && ++passed <= most_passed) continue;
#endif
#endif
                best = RayHit(tuv.x, triangle, tuv.y, tuv.z);
                first = number;
#ifdef ANY_HIT
                return best;
#endif
            }
        }
    }
    return best;  // never reached, but a compiler may not see that
}
