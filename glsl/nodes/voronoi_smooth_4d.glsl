// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's Smooth F1 of four dimensions, as Cycles 5.0 has it: xyz the colour, w the distance;
// with `placed` xyz and w the place. `metric` counts as lib/voronoi.glsl does;
// Minkowski's is a node of its own.
// Long to compile.
// Operands: vector, w, scale detail roughness lacunarity, randomness [metric] [normalized], smoothness [placed].
#include "lib/voronoi_points.glsl"

vec4 run_voronoi_smooth_4d(vec4 vector, vec4 w, vec4 octaves, vec4 shape, vec4 options) {
    Cells cells = Cells(clamp(shape.x, 0.0, 1.0), int(shape.y), false, 0.0);
    vec4 place = vec4(vector.xyz, w.x) * octaves.x;
    float smoothness = smoothness_of(options.x);
    return voronoi_texture(
        place, octaves.x, octaves_of(octaves, shape.z), cells, false, true, smoothness, options.y > 0.5, 4
    );
}
