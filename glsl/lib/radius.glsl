// SPDX-License-Identifier: GPL-3.0-or-later
// The gather radius at every place: addon/photon/radius_field.py. Uses the table radii, eight floats a
// cell: its corners, x fastest, then y, then z.
#include "lib/table.glsl"

float radius_at(vec3 position) {
    vec3 at = clamp((position - field_origin) / field_cell, vec3(0.0), vec3(field_cells));
    ivec3 cell = min(ivec3(at), field_cells - 1);
    vec3 share = at - vec3(cell);
    int first = 2 * ((cell.z * field_cells.y + cell.y) * field_cells.x + cell.x);
    vec4 z = mix(texelFetch(radii, table_texel(first), 0), texelFetch(radii, table_texel(first + 1), 0), share.z);
    vec2 y = mix(z.xy, z.zw, share.y);
    return mix(y.x, y.y, share.x) * shrink;
}
