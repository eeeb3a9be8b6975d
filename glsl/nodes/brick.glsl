// SPDX-License-Identifier: GPL-3.0-or-later
// Brick Texture, as Cycles 5.0 has it (intern/cycles/kernel/svm/brick.h): xyz how much of Color2 a brick has, w how
// much mortar there is.
// Operands: vector, scale mortar_size mortar_smooth bias, width height offset squash, [offset_frequency] [squash_frequency].

// A random number of a brick, in [0, 1], by integer noise.
float brick_noise(uint n) {
    n = (n + 1013u) & 0x7fffffffu;
    n = (n >> 13) ^ n;
    return float((n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu) / 2147483648.0;
}

// The number of a brick or row: as processors convert what is too large, or no number, as where bricks have no width.
int number_of(float count) { return abs(count) < 2147483648.0 ? int(floor(count)) : int(0x80000000u); }

bool is_nth(int row, float every) { return abs(row) % int(every) == 0; }

vec4 run_brick(vec4 vector, vec4 mortar, vec4 size, vec4 every) {
    vec2 at = vector.xy * mortar.x;
    int row = number_of(at.y / size.y);
    float width = size.x, shift = 0.0;
    if (every.x >= 1.0 && every.y >= 1.0) {
        if (is_nth(row, every.y)) width *= size.w;
        if (is_nth(row, every.x)) shift = width * size.z;
    }
    int column = number_of((at.x + shift) / width);
    vec2 within = vec2(at.x + shift - width * float(column), at.y - size.y * float(row));
    float tint = clamp(brick_noise((uint(row) << 16) + (uint(column) & 0xffffu)) + mortar.w, 0.0, 1.0);
    float edge = min(min(within.x, within.y), min(width - within.x, size.y - within.y));
    float share = 0.0;
    if (edge < mortar.y) share = mortar.z == 0.0 ? 1.0 : smoothstep(0.0, 1.0, (1.0 - edge / mortar.y) / mortar.z);
    return vec4(vec3(tint), share);
}
