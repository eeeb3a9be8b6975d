// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's Distance to Edge of any dimension (intern/cycles/kernel/svm/voronoi.h; Quilez 2012, "Voronoi
// borders"): how far it is to the nearest plane half way between the nearest point and another.
#include "lib/voronoi.glsl"

float distance_to_edge(vec4 place, float randomness, int dimensions) {
    vec4 corner = floor(place), within = place - corner, nearest = vec4(0.0);
    float first = 3.402823e38, edge = first;
    ivec4 reach = reach_of_cells(1, dimensions);
    for (int turn = 0; turn < 2; ++turn)
    for (int w = -reach.w; w <= reach.w; ++w)
    for (int z = -reach.z; z <= reach.z; ++z)
    for (int y = -reach.y; y <= reach.y; ++y)
    for (int x = -reach.x; x <= reach.x; ++x) {
        ivec4 offset = ivec4(x, y, z, w);
        vec4 to = point_of_cell(ivec4(corner) + offset, offset, randomness, dimensions) - within;
        float there = dot(to, to);
        vec4 across = to - nearest;
        if (turn == 0) {
            if (there < first) {
                first = there;
                nearest = to;
            }
        } else if (dot(across, across) > 0.0001) {
            edge = min(edge, dot(0.5 * (nearest + to), normalize(across)));
        }
    }
    return edge;
}

// Between points on a line the middle is an edge also where they are close together.
float distance_to_edge_1d(float place, float randomness) {
    float corner = floor(place), within = place - corner;
    vec3 points;
    for (int i = -1; i <= 1; ++i) {
        points[i + 1] = float(i) + hashed_1(corner + float(i)) * randomness;
    }
    vec2 middles = 0.5 * (points.xy + points.yz);
    return min(abs(middles.x - within), abs(middles.y - within));
}

// The distance in all four. `octaves`: scale, detail, roughness, lacunarity.
vec4 voronoi_edge_texture(vec4 place, vec4 octaves, float randomness, bool normalized, int dimensions) {
    float detail = clamp(octaves.y, 0.0, 15.0), roughness = clamp(octaves.z, 0.0, 1.0);
    randomness = clamp(randomness, 0.0, 1.0);
    float farthest = 0.5 + 0.5 * randomness;
    float amplitude = 1.0, frequency = 1.0, nearest = 8.0, most = farthest;
    bool one = detail == 0.0 || roughness == 0.0;
    float last = one ? 0.0 : ceil(detail);
    for (float i = 0.0; i <= last; ++i) {
        float share = amplitude * (one || i <= detail ? 1.0 : fract(detail)), there;
        if (dimensions == 1) there = distance_to_edge_1d(place.x * frequency, randomness);
        else there = distance_to_edge(place * frequency, randomness, dimensions);
        most = mix(most, farthest / frequency, share);
        nearest = one ? there : mix(nearest, min(nearest, there / frequency), share);
        frequency *= octaves.w;
        amplitude *= roughness;
    }
    return vec4(normalized ? nearest / most : nearest);
}
