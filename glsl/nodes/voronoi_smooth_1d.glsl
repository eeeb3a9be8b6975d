// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's Smooth F1 of one dimension, as Cycles 5.0 has it: xyz the colour, w the distance;
// with `placed` xyz and w the place.
// Long to compile.
// Operands: w, scale detail roughness lacunarity, randomness [normalized], smoothness [placed].
#include "lib/voronoi_points.glsl"

vec4 run_voronoi_smooth_1d(vec4 w, vec4 octaves, vec4 shape, vec4 options) {
    Cells cells = Cells(clamp(shape.x, 0.0, 1.0), METRIC_EUCLIDEAN, false, 0.0);
    vec4 place = vec4(w.x, 0.0, 0.0, 0.0) * octaves.x;
    float smoothness = smoothness_of(options.x);
    return voronoi_texture(
        place, octaves.x, octaves_of(octaves, shape.y), cells, false, true, smoothness, options.y > 0.5, 1
    );
}
