// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's F1, F2 and Smooth F1 of any dimension and metric (intern/cycles/kernel/svm/voronoi.h; Quilez 2013):
// the nearest, the second nearest point, or all about, blended.
#include "lib/voronoi.glsl"

struct Found {
    float distance;
    vec3 colour;
    vec4 place;
};

Found found_nearest(vec4 place, Cells cells, bool second, int dimensions) {
    vec4 corner = floor(place), within = place - corner;
    ivec4 first_cell = ivec4(0), second_cell = ivec4(0);
    vec4 first_point = vec4(0.0), second_point = vec4(0.0);
    float first = 3.402823e38, next = first;
    ivec4 reach = reach_of_cells(1, dimensions);
    for (int w = -reach.w; w <= reach.w; ++w)
    for (int z = -reach.z; z <= reach.z; ++z)
    for (int y = -reach.y; y <= reach.y; ++y)
    for (int x = -reach.x; x <= reach.x; ++x) {
        ivec4 offset = ivec4(x, y, z, w), cell = ivec4(corner) + offset;
        vec4 point = point_of_cell(cell, offset, cells.randomness, dimensions);
        float there = before_distance(point - within, cells);
        if (there < first) {
            next = first;
            second_cell = first_cell;
            second_point = first_point;
            first = there;
            first_cell = cell;
            first_point = point;
        } else if (there < next) {
            next = there;
            second_cell = cell;
            second_point = point;
        }
    }
    float nearest = as_distance(second ? next : first, cells);
    vec3 colour = colour_of_cell(second ? second_cell : first_cell, dimensions);
    return Found(nearest, colour, (second ? second_point : first_point) + corner);
}

// `smoothness` in (0, 0.5].
Found found_smooth(vec4 place, Cells cells, float smoothness, int dimensions) {
    vec4 corner = floor(place), within = place - corner;
    Found found = Found(0.0, vec3(0.0), vec4(0.0));
    bool begun = false;
    ivec4 reach = reach_of_cells(2, dimensions);
    for (int w = -reach.w; w <= reach.w; ++w)
    for (int z = -reach.z; z <= reach.z; ++z)
    for (int y = -reach.y; y <= reach.y; ++y)
    for (int x = -reach.x; x <= reach.x; ++x) {
        ivec4 offset = ivec4(x, y, z, w), cell = ivec4(corner) + offset;
        vec4 point = point_of_cell(cell, offset, cells.randomness, dimensions);
        float there = as_distance(before_distance(point - within, cells), cells);
        float share = smoothstep(0.0, 1.0, 0.5 + 0.5 * (found.distance - there) / smoothness);
        if (!begun) share = 1.0;
        begun = true;
        float less = smoothness * share * (1.0 - share), less_still = less / (1.0 + 3.0 * smoothness);
        found.distance = mix(found.distance, there, share) - less;
        found.colour = mix(found.colour, colour_of_cell(cell, dimensions), share) - less_still;
        found.place = mix(found.place, point, share) - less_still;
    }
    found.place += corner;
    return found;
}

struct VoronoiOctaves {
    float detail, roughness, lacunarity;  // as of Fractal in lib/fractal.glsl
    bool normalized;
};

VoronoiOctaves octaves_of(vec4 octaves, float normalized) {
    return VoronoiOctaves(clamp(octaves.y, 0.0, 15.0), clamp(octaves.z, 0.0, 1.0), octaves.w, normalized > 0.5);
}

// Of the node's: in (0, 0.5]. With none the nearest point is left of the blend.
float smoothness_of(float given) { return clamp(0.5 * given, 0.00001, 0.5); }

// The colour in xyz and the distance in w, or with `placed` the place in all four. `blended`, a constant wherever it is
// called but in rare nodes, says that points about are blended.
vec4 voronoi_texture(
    vec4 place, float scale, VoronoiOctaves octaves, Cells cells, bool second, bool blended, float smoothness, bool placed,
    int dimensions
) {
    Found sum = Found(0.0, vec3(0.0), vec4(0.0));
    float amplitude = 1.0, total = 0.0, frequency = 1.0;
    bool one = octaves.detail == 0.0 || octaves.roughness == 0.0;
    float last = one ? 0.0 : ceil(octaves.detail);
    for (float i = 0.0; i <= last; ++i) {
        Found octave;
        if (blended) octave = found_smooth(place * frequency, cells, smoothness, dimensions);
        else octave = found_nearest(place * frequency, cells, second, dimensions);
        float share = amplitude * (one || i <= octaves.detail ? 1.0 : fract(octaves.detail));
        total += share;
        sum.distance += share * octave.distance;
        sum.colour += share * octave.colour;
        sum.place = mix(sum.place, octave.place / frequency, share);
        frequency *= octaves.lacunarity;
        amplitude *= octaves.roughness;
    }
    if (placed) {
        // A blend moves all four; of one dimension the coordinate is W.
        vec4 found = sum.place * vec4(reach_of_cells(1, dimensions));
        if (dimensions == 1) found = found.wzyx;
        return scale == 0.0 ? vec4(0.0) : found / scale;
    }
    if (octaves.normalized) {
        vec4 farthest = vec4(0.5 + 0.5 * cells.randomness) * vec4(reach_of_cells(1, dimensions));
        sum.distance /= total * as_distance(before_distance(farthest, cells), cells) * (second ? 2.0 : 1.0);
        sum.colour /= total;
    }
    return vec4(sum.colour, sum.distance);
}
