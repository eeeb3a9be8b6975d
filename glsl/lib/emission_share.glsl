// SPDX-License-Identifier: GPL-3.0-or-later
// What an emissive triangle radiates at a place in a direction over what it does in the mean, as its program told
// beforehand (photon/stage/emission.py). Uses the table of emission shares.
#include "lib/table.glsl"

vec3 emission_texel(int index) { return texelFetch(emission_shares, table_texel(index), 0).rgb; }

// The cell of a place, in coordinates along the sides from the triangle's first corner.
ivec2 cell_of(Light light, vec3 place, int cells) {
    vec3 along = light.parameters.xyz - light.position, up = light.more.xyz - light.position;
    vec3 normal = cross(along, up), to_place = place - light.position;
    vec2 at = vec2(dot(cross(to_place, up), normal), dot(cross(along, to_place), normal)) / dot(normal, normal);
    ivec2 cell = clamp(ivec2(floor(at * float(cells))), ivec2(0), ivec2(cells - 1));
    return ivec2(cell.x, min(cell.y, cells - 1 - cell.x));  // rounding may be beyond the last side
}

vec3 emission_share(Light light, vec3 place, vec3 direction) {
    if (!(light.gobo_width > 0.0)) return vec3(1.0);
    int cells = int(light.gobo_width), angles = int(light.gobo_height);
    float cosine = dot(direction, light.axis);
    int first = int(light.gobo) + (cosine < 0.0 ? cells * cells + angles : 0);
    ivec2 cell = cell_of(light, place, cells);
    vec3 share = emission_texel(first + cell.y * cells + cell.x);
    if (angles == 0) return share;
    float at = min(abs(cosine), 1.0) * float(angles - 1);
    int low = min(int(at), angles - 2), angle = first + cells * cells + low;
    return share * mix(emission_texel(angle), emission_texel(angle + 1), at - float(low));
}
