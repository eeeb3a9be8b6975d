// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's Distance to Edge of three dimensions, as Cycles 5.0 has it, in xyz and w.
// Long to compile.
// Operands: vector, scale detail roughness lacunarity, randomness [normalized].
#include "lib/voronoi_edge.glsl"

vec4 run_voronoi_edge_3d(vec4 vector, vec4 octaves, vec4 shape) {
    return voronoi_edge_texture(vec4(vector.xyz, 0.0) * octaves.x, octaves, shape.x, shape.y > 0.5, 3);
}
