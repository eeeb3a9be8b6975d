// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's F1, with `second` F2, of three dimensions, as Cycles 5.0 has it: xyz the colour, w the distance;
// with `placed` xyz and w the place. `metric` counts as lib/voronoi.glsl does;
// Minkowski's is a node of its own.
// Long to compile.
// Operands: vector, scale detail roughness lacunarity, randomness [metric] [normalized], [second] [placed].
#include "lib/voronoi_points.glsl"

vec4 run_voronoi_3d(vec4 vector, vec4 octaves, vec4 shape, vec4 options) {
    Cells cells = Cells(clamp(shape.x, 0.0, 1.0), int(shape.y), false, 0.0);
    vec4 place = vec4(vector.xyz, 0.0) * octaves.x;
    return voronoi_texture(
        place, octaves.x, octaves_of(octaves, shape.z), cells, options.x > 0.5, false, 0.0, options.y > 0.5, 3
    );
}
