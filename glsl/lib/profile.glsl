// SPDX-License-Identifier: GPL-3.0-or-later
// How bright a light is in each direction, of mean 1: a table over even polar angles, from the axis to behind it, and
// even azimuths. Uses the table of profiles.
#include "lib/sampling.glsl"

bool has_profile(Light light) { return light.rows > 0.0; }

Profile profile_of(Light light, int row, int column) {
    return profile_at(int(light.first) + row * int(light.columns) + column % int(light.columns));
}

// Azimuths as those of IES files.
mat3 frame_of_profile(Light light) { return mat3(-cross(light.across, light.axis), -light.across, light.axis); }

float profile_share(Light light, vec3 direction) {
    if (!has_profile(light)) return 1.0;
    vec3 local = direction * frame_of_profile(light);
    float turn = local.xy == vec2(0.0) ? 0.0 : atan(local.y, local.x) / (2.0 * PI);
    vec2 at = vec2(acos(clamp(local.z, -1.0, 1.0)) / PI * (light.rows - 1.0), fract(turn) * light.columns);
    int row = min(int(at.x), int(light.rows) - 2), column = int(at.y);
    vec2 within = vec2(at.x - float(row), at.y - float(column));
    float low = mix(profile_of(light, row, column).share, profile_of(light, row, column + 1).share, within.y);
    float high = mix(profile_of(light, row + 1, column).share, profile_of(light, row + 1, column + 1).share, within.y);
    return mix(low, high, within.x);
}

// A direction with a density that is even in each cell of the table, and one over 4 PI times that.
vec3 sample_profile(Light light, vec2 u, out float weight) {
    int low = 0, high = int(light.rows) - 2;
    while (low < high) {
        int middle = (low + high) / 2;
        if (u.x < profile_of(light, middle, 0).down) high = middle; else low = middle + 1;
    }
    int row = low;
    low = 0;
    high = int(light.columns) - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (u.y < profile_of(light, row, middle).along) high = middle; else low = middle + 1;
    }
    Profile cell = profile_of(light, row, low);
    float above = row > 0 ? profile_of(light, row - 1, 0).down : 0.0;
    float before = low > 0 ? profile_of(light, row, low - 1).along : 0.0;
    vec2 within = clamp(vec2((u.x - above) / (cell.down - above), (u.y - before) / (cell.along - before)), 0.0, 1.0);
    float step = PI / (light.rows - 1.0);
    vec2 sine = sin(0.5 * step * vec2(float(row), float(row + 1)));
    float versine = 2.0 * mix(sine.x * sine.x, sine.y * sine.y, within.x);
    weight = 1.0 / cell.mean;
    vec3 local = direction_from_versine(versine, 2.0 * PI * (float(low) + within.y) / light.columns);
    return frame_of_profile(light) * local;
}
