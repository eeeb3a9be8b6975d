// SPDX-License-Identifier: GPL-3.0-or-later
// An Image or Environment Texture, as Cycles 5.0 has it (kernel/svm/image.h): xyz is the colour in linear light, w alpha.
// `image` is the number of the texture, or of the first of `tiles` textures, which lie in UDIM cells. Projection:
// flat (0), box (1), sphere (2), tube (3); of directions equirectangular (4), mirror ball (5). The box's faces are those of the normal in object space, and overlap by
// `blend`. `separated` is 1: the colour is not multiplied by alpha. `texels` are those of lib/image.glsl; `faces` are 3
// of a box, else 1.
// Long to compile.
// Operands: vector, normal, image tiles texels extension, [projection] blend [separated] faces.
#include "lib/constants.glsl"
#include "lib/image.glsl"

const vec4 NO_IMAGE = vec4(1.0, 0.0, 1.0, 1.0);

vec2 on_sphere(vec3 at) {
    float far = length(at);
    if (!(far > 0.0)) return vec2(0.0);
    float across = at.x == 0.0 && at.y == 0.0 ? 0.0 : 0.5 - atan(at.x, at.y) / (2.0 * PI);
    return vec2(across, 1.0 - acos(clamp(at.z / far, -1.0, 1.0)) / PI);
}

vec2 on_tube(vec3 at) {
    if (!(length(at.xy) > 0.0)) return vec2(0.0);
    return vec2(0.5 - atan(at.x, at.y) / (2.0 * PI), 0.5 * (at.z + 1.0));
}

vec2 in_direction(vec3 direction) {
    float far = length(direction);
    if (!(far > 0.0)) return vec2(0.0);
    vec3 unit = direction / far;
    float turn = unit.x == 0.0 && unit.y == 0.0 ? 0.0 : atan(unit.y, unit.x);
    return vec2(0.5 - turn / (2.0 * PI), 1.0 - acos(clamp(unit.z, -1.0, 1.0)) / PI);
}

// The ball is seen along y.
vec2 on_mirror_ball(vec3 direction) {
    float far = length(direction);
    vec3 unit = far > 0.0 ? direction / far : vec3(0.0);
    vec3 normal = unit - vec3(0.0, 1.0, 0.0);
    float size = 2.0 * sqrt(max(-0.5 * normal.y, 0.0));
    if (size > 0.0) normal /= size;
    return 0.5 * (normal.xz + 1.0);
}

// How much of a box's faces across x, y and z one sees where the normal has these sizes, which add up to 1. Of each
// pair the larger counts alone until the other is within the blend; of all three none is left out.
vec3 box_weights(vec3 n, float blend) {
    float limit = 0.5 * (1.0 + blend);
    if (n.x > limit * (n.x + n.y) && n.x > limit * (n.x + n.z)) return vec3(1.0, 0.0, 0.0);
    if (n.y > limit * (n.x + n.y) && n.y > limit * (n.y + n.z)) return vec3(0.0, 1.0, 0.0);
    if (n.z > limit * (n.x + n.z) && n.z > limit * (n.y + n.z)) return vec3(0.0, 0.0, 1.0);
    if (!(blend > 0.0)) return vec3(1.0, 0.0, 0.0);
    float least = 0.5 * (1.0 - blend);
    if (n.z < (1.0 - limit) * (n.y + n.x)) {
        float x = clamp((n.x / (n.x + n.y) - least) / blend, 0.0, 1.0);
        return vec3(x, 1.0 - x, 0.0);
    }
    if (n.x < (1.0 - limit) * (n.y + n.z)) {
        float y = clamp((n.y / (n.y + n.z) - least) / blend, 0.0, 1.0);
        return vec3(0.0, y, 1.0 - y);
    }
    if (n.y < (1.0 - limit) * (n.x + n.z)) {
        float x = clamp((n.x / (n.x + n.z) - least) / blend, 0.0, 1.0);
        return vec3(x, 0.0, 1.0 - x);
    }
    return ((2.0 - limit) * n + (limit - 1.0)) / (2.0 * limit - 1.0);
}

// Number of the texture of the UDIM cell that `uv` lies in, and where it is in that cell; -1: there is none.
int tile_at(int first, int count, inout vec2 uv) {
    if (any(isnan(uv)) || any(greaterThan(abs(uv), vec2(1.0e6)))) return -1;
    ivec2 cell = ivec2(uv);
    if (cell.x < 0 || cell.y < 0 || cell.x >= 10) return -1;
    for (int i = first; i < first + count; i++) {
        if (tile_of(i) == 1001 + 10 * cell.y + cell.x) {
            uv -= vec2(cell);
            return i;
        }
    }
    return -1;
}

// Where a box's face across an axis shows the image.
vec2 on_face(int face, vec3 at, vec3 normal) {
    if (face == 0) return vec2(normal.x < 0.0 ? 1.0 - at.y : at.y, at.z);
    if (face == 1) return vec2(normal.y > 0.0 ? 1.0 - at.x : at.x, at.z);
    return vec2(normal.z > 0.0 ? 1.0 - at.y : at.y, at.x);
}

vec4 run_image(vec4 vector, vec4 normal, vec4 image, vec4 options) {
    int number = int(image.x), tiles = int(image.y), projection = int(options.x);
    vec2 uv = vector.xy;
    vec3 weights = vec3(1.0, 0.0, 0.0), sizes = abs(normal.xyz);
    if (projection == 1) weights = box_weights(sizes / (sizes.x + sizes.y + sizes.z), options.y);
    if (projection == 2) uv = on_sphere(2.0 * vector.xyz - 1.0);
    if (projection == 3) uv = on_tube(2.0 * vector.xyz - 1.0);
    if (projection == 4) uv = in_direction(vector.xyz);
    if (projection == 5) uv = on_mirror_ball(vector.xyz);
    if (tiles > 0) number = tile_at(number, tiles, uv);
    if (number < 0) return NO_IMAGE;
    vec4 sum = vec4(0.0);
    for (int face = 0; face < int(options.w); face++) {
        float weight = face == 0 ? weights.x : face == 1 ? weights.y : weights.z;
        if (!(weight > 0.0)) continue;
        if (projection == 1) uv = on_face(face, vector.xyz, normal.xyz);
        sum += weight * sample_image(number, uv, int(image.z), int(image.w), options.z > 0.0);
    }
    return sum;
}
