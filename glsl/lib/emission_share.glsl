// SPDX-License-Identifier: GPL-3.0-or-later
// What an emissive triangle radiates at a place in a direction over what it does in the mean, as its program told
// beforehand (photon/stage/emission.py). Uses the table of emission shares: of each triangle how many cells a side has
// and how many angles, then the shares of its front's cells and angles and of its back's.
#include "lib/table.glsl"

vec4 emission_texel(int index) { return texelFetch(emission_shares, table_texel(index), 0); }

// The cell of a place, in coordinates along the sides from the triangle's first corner.
ivec2 cell_of(Light light, vec3 place, int cells) {
    vec3 along = light.parameters.xyz - light.position, up = light.more.xyz - light.position;
    vec3 normal = cross(along, up), to_place = place - light.position;
    vec2 at = vec2(dot(cross(to_place, up), normal), dot(cross(along, to_place), normal)) / dot(normal, normal);
    ivec2 cell = clamp(ivec2(floor(at * float(cells))), ivec2(0), ivec2(cells - 1));
    return ivec2(cell.x, min(cell.y, cells - 1 - cell.x));  // rounding may be beyond the last side
}

vec3 emission_share(Light light, vec3 place, vec3 direction) {
    int head = int(light.more.w) - 1;
    if (head < 0) return vec3(1.0);
    ivec2 counts = ivec2(emission_texel(head).xy);
    int cells = counts.x, angles = counts.y;
    float cosine = dot(direction, light.axis);
    int first = head + 1 + (cosine < 0.0 ? cells * cells + angles : 0);
    ivec2 cell = cell_of(light, place, cells);
    vec3 share = emission_texel(first + cell.y * cells + cell.x).rgb;
    if (angles == 0) return share;
    float at = min(abs(cosine), 1.0) * float(angles - 1);
    int low = min(int(at), angles - 2), angle = first + cells * cells + low;
    return share * mix(emission_texel(angle).rgb, emission_texel(angle + 1).rgb, at - float(low));
}
