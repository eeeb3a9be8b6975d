// SPDX-License-Identifier: GPL-3.0-or-later
// Jenkins 2006, "lookup3": hashes of one to four words, by which Cycles' textures draw their random numbers.

uint turned(uint x, int bits) { return (x << bits) | (x >> (32 - bits)); }

uint hash_end(uint a, uint b, uint c) {
    c = (c ^ b) - turned(b, 14);
    a = (a ^ c) - turned(c, 11);
    b = (b ^ a) - turned(a, 25);
    c = (c ^ b) - turned(b, 16);
    a = (a ^ c) - turned(c, 4);
    b = (b ^ a) - turned(a, 14);
    return (c ^ b) - turned(b, 24);
}

uint hash_begin(uint words) { return 0xdeadbeefu + 4u * words + 13u; }

uint hash_1(uint x) {
    uint begin = hash_begin(1u);
    return hash_end(begin + x, begin, begin);
}

uint hash_2(uvec2 k) {
    uint begin = hash_begin(2u);
    return hash_end(begin + k.x, begin + k.y, begin);
}

uint hash_3(uvec3 k) {
    uvec3 begin = uvec3(hash_begin(3u)) + k;
    return hash_end(begin.x, begin.y, begin.z);
}

uint hash_4(uvec4 k) {
    uint begin = hash_begin(4u), a = begin + k.x, b = begin + k.y, c = begin + k.z;
    a = (a - c) ^ turned(c, 4);
    c += b;
    b = (b - a) ^ turned(a, 6);
    a += c;
    c = (c - b) ^ turned(b, 8);
    b += a;
    a = (a - c) ^ turned(c, 16);
    c += b;
    b = (b - a) ^ turned(a, 19);
    a += c;
    c = (c - b) ^ turned(b, 4);
    b += a;
    return hash_end(a + k.w, b, c);
}

// In [0, 1].
float hashed(uint bits) { return float(bits) * (1.0 / 4294967296.0); }

// Of floats to the bit, in [0, 1].
float hashed_1(float x) { return hashed(hash_1(floatBitsToUint(x))); }
float hashed_2(vec2 k) { return hashed(hash_2(floatBitsToUint(k))); }
float hashed_3(vec3 k) { return hashed(hash_3(floatBitsToUint(k))); }
float hashed_4(vec4 k) { return hashed(hash_4(floatBitsToUint(k))); }
