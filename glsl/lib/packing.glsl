// SPDX-License-Identifier: GPL-3.0-or-later
// A unit vector in one float: octahedral, as an integer below (steps + 1)^2; of 12 bits an axis exact.
// Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors".

float pack_octahedral(vec3 n, float steps) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 e = n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    vec2 q = floor((e * 0.5 + 0.5) * steps + 0.5);
    return q.x * (steps + 1.0) + q.y;
}

// A vector along it, no shorter than 0.57.
vec3 unpack_octahedral(float code, float steps) {
    float x = floor(code / (steps + 1.0));
    vec2 e = vec2(x, code - x * (steps + 1.0)) / steps * 2.0 - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return n;
}

float pack_direction(vec3 n) { return pack_octahedral(n, 4095.0); }

vec3 unpack_along(float code) { return unpack_octahedral(code, 4095.0); }

vec3 unpack_direction(float code) { return normalize(unpack_along(code)); }

// A flux that carries a packed direction in the last 8 bits of each channel: it keeps 16 bits, and its mean.
// No channel is 0, whose last bits devices may take for 0.
vec3 flux_with_direction(vec3 flux, vec3 direction) {
    uint code = uint(pack_direction(direction));
    uvec3 last = uvec3(code >> 16, code >> 8, code) & 0xffu;
    return uintBitsToFloat((floatBitsToUint(max(flux, vec3(1.0e-30))) & 0xffffff00u) | last);
}

vec3 direction_with_flux(vec3 flux) {
    uvec3 last = floatBitsToUint(flux) & 0xffu;
    return unpack_direction(float((last.x << 16) | (last.y << 8) | last.z));
}
