// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow rays through clear glass (Snell's and Fresnel's laws). Uses the tables of triangles, of their normals and of
// materials.
#include "lib/fresnel.glsl"
#include "lib/pane.glsl"
#include "lib/surface.glsl"

// Whether such a ray goes on behind the flat face of glass that it has met: where to, and what that lets through.
bool goes_through_pane(Hit hit, vec3 direction, out vec3 onward, out vec3 through) {
    Surface surface = surface_at(hit, direction);
    Material material = material_at(surface.material);
    onward = direction;
    through = vec3(0.0);
    if (!(material.pane > 0.0) || dot(surface.shading, surface.geometric) < FLAT) return false;
    float ior = surface.side > 0.0 ? material.pane : 1.0 / material.pane;
    float cosine = -dot(direction, surface.geometric), squared = 1.0 - (1.0 - cosine * cosine) / (ior * ior);
    if (!(squared > 0.0)) return false;
    onward = normalize(direction / ior + (cosine / ior - sqrt(squared)) * surface.geometric);
    through = (1.0 - fresnel_dielectric(cosine, ior)) * material.pane_colour;
    return true;
}
