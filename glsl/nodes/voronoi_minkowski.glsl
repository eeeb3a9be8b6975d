// SPDX-License-Identifier: GPL-3.0-or-later
// Voronoi Texture's F1, F2 and Smooth F1 by Minkowski's metric, of two to four dimensions, as Cycles 5.0 has it: xyz
// the colour, w the distance; with `placed` xyz and w the place. `feature`: 0 F1, 1 F2, 2 Smooth F1.
// Long to compile.
// Operands: vector, w, scale detail roughness lacunarity, randomness exponent [normalized], [feature] smoothness [placed] [dimensions].
#include "lib/voronoi_points.glsl"

vec4 run_voronoi_minkowski(vec4 vector, vec4 w, vec4 octaves, vec4 shape, vec4 options) {
    Cells cells = Cells(clamp(shape.x, 0.0, 1.0), METRIC_EUCLIDEAN, true, shape.y);
    int feature = int(options.x), dimensions = int(options.w);
    vec4 place = octaves.x * vec4(vector.xy, dimensions > 2 ? vector.z : 0.0, dimensions > 3 ? w.x : 0.0);
    return voronoi_texture(
        place, octaves.x, octaves_of(octaves, shape.z), cells, feature == 1, feature == 2, smoothness_of(options.y),
        options.z > 0.5, dimensions
    );
}
