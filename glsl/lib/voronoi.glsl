// SPDX-License-Identifier: GPL-3.0-or-later
// What Voronoi textures of one to four dimensions share: a random point in each cell of a grid, Cycles' hashes of
// cells (Jarzynski & Olano 2020, of signed numbers), and metrics. `dimensions` is a constant wherever a function is
// called, but in nodes that are rare, so a program holds the dimensions that it asks for.
#include "lib/jenkins.glsl"

const int METRIC_EUCLIDEAN = 0;
const int METRIC_MANHATTAN = 1;
const int METRIC_CHEBYCHEV = 2;

struct Cells {
    float randomness;  // in [0, 1]: 0 has each point at its cell's corner
    int metric;
    bool minkowski;  // instead of the metric: a constant wherever Cells are made, for powers are slow
    float exponent;  // Minkowski's
};

vec4 fraction_of(ivec4 bits) { return vec4(bits & 0x7fffffff) * (1.0 / 2147483648.0); }

vec4 hashed_cell_2(ivec2 v) {
    v = v * 1664525 + 1013904223;
    v.x += v.y * 1664525;
    v.y += v.x * 1664525;
    v ^= v >> 16;
    v.x += v.y * 1664525;
    v.y += v.x * 1664525;
    return fraction_of(ivec4(v, 0, 0));
}

vec4 hashed_cell_3(ivec3 v) {
    v = v * 1664525 + 1013904223;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return fraction_of(ivec4(v, 0));
}

vec4 hashed_cell_4(ivec4 v) {
    v = v * 1664525 + 1013904223;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return fraction_of(v);
}

// Where a cell's point is, from the grid's origin of `offset`, which is the cell's from there.
vec4 point_of_cell(ivec4 cell, ivec4 offset, float randomness, int dimensions) {
    vec4 random;
    if (dimensions == 1) random = vec4(hashed_1(float(cell.x)), 0.0, 0.0, 0.0);
    else if (dimensions == 2) random = hashed_cell_2(cell.xy);
    else if (dimensions == 3) random = hashed_cell_3(cell.xyz);
    else random = hashed_cell_4(cell);
    return vec4(offset) + random * randomness;
}

vec3 colour_of_cell(ivec4 cell, int dimensions) {
    if (dimensions == 1) {
        float at = float(cell.x);
        return vec3(hashed_1(at), hashed_2(vec2(at, 1.0)), hashed_2(vec2(at, 2.0)));
    }
    return dimensions == 4 ? hashed_cell_4(cell).xyz : hashed_cell_3(ivec3(cell.xy, dimensions == 2 ? 0 : cell.z)).xyz;
}

// What is in the order of distances, and the distance of it. Coordinates beyond the dimensions are 0.
float before_distance(vec4 to, Cells cells) {
    vec4 size = abs(to);
    if (cells.minkowski) {
        vec4 power = pow(size, vec4(cells.exponent));
        return power.x + power.y + power.z + power.w;
    }
    if (cells.metric == METRIC_MANHATTAN) return size.x + size.y + size.z + size.w;
    if (cells.metric == METRIC_CHEBYCHEV) return max(max(size.x, size.y), max(size.z, size.w));
    return dot(to, to);
}

float as_distance(float before, Cells cells) {
    if (cells.minkowski) return pow(before, 1.0 / cells.exponent);
    return cells.metric == METRIC_EUCLIDEAN ? sqrt(before) : before;
}

// How many cells away points may count, along each axis.
ivec4 reach_of_cells(int cells, int dimensions) {
    return cells * ivec4(1, dimensions > 1 ? 1 : 0, dimensions > 2 ? 1 : 0, dimensions > 3 ? 1 : 0);
}
