// SPDX-License-Identifier: GPL-3.0-or-later
// Images as textures of materials: how they are stored (stage/textures.py), interpolated and extended, as Cycles 5.0
// does it (kernel/device/cpu/image.h): the centres of texels lie half a texel from the edges.
const int CLOSEST = 1, LINEAR = 2, CUBIC = 4;  // texels that are read each way
const int REPEAT = 0, EXTEND = 1, CLIP = 2, MIRROR = 3;
// Bits of a picture's kind: log2 of the bytes of a channel; whether it has four; what the channels are.
const int CHANNEL_BYTES = 3, HAS_FOUR = 4, IS_FLOAT = 8, IS_SRGB = 16;

// First word of an image in the list of all images' words, its size in texels, and its kind.
struct Picture { int first; ivec2 size; int kind; };

// Rows of 4096 words, 2048 of them a page.
uint texel_word(int index) { return texelFetch(texels, ivec3(index & 4095, (index >> 12) & 2047, index >> 23), 0).x; }

Picture picture_at(int image) {
    int at = 4 * image;
    int size = int(texel_word(at + 1));
    return Picture(int(texel_word(at)) << 12, ivec2(size & 0xffff, size >> 16 & 0xffff), int(texel_word(at + 2)));
}

// Its UDIM number; 0: it is no tile.
int tile_of(int image) { return int(texel_word(4 * image + 3)); }

float half_number(uint bits) {
#if __VERSION__ >= 420
    return unpackHalf2x16(bits).x;
#else
    // The exponent of a half number is 112 too small for a float's.
    return uintBitsToFloat((bits & 0x7fffu) << 13 | (bits & 0x8000u) << 16) * 5.192296858534828e33;
#endif
}

float channel_of(uint bits, int kind) {
    if ((kind & CHANNEL_BYTES) == 2) return uintBitsToFloat(bits);
    if ((kind & IS_FLOAT) != 0) return half_number(bits);
    return float(bits) / ((kind & CHANNEL_BYTES) == 0 ? 255.0 : 65535.0);
}

// A texel that is there; a grey one is opaque.
vec4 texel_of(Picture picture, ivec2 at) {
    int number = at.y * picture.size.x + at.x, bytes = picture.kind & CHANNEL_BYTES;
    if ((picture.kind & HAS_FOUR) == 0) {
        uint word = texel_word(picture.first + (number >> (2 - bytes)));
        int within = (number & ((1 << (2 - bytes)) - 1)) << (3 + bytes);
        uint bits = bytes == 2 ? word : (word >> uint(within)) & ((1u << uint(8 << bytes)) - 1u);
        return vec4(vec3(channel_of(bits, picture.kind)), 1.0);
    }
    int first = picture.first + (number << bytes);
    uvec4 bits = uvec4(texel_word(first));
    if (bytes == 0) {
        bits = (bits >> uvec4(0u, 8u, 16u, 24u)) & 255u;
    } else if (bytes == 1) {
        bits.zw = uvec2(texel_word(first + 1));
        bits = (bits >> uvec4(0u, 16u, 0u, 16u)) & 0xffffu;
    } else {
        bits.yzw = uvec3(texel_word(first + 1), texel_word(first + 2), texel_word(first + 3));
    }
    return vec4(
        channel_of(bits.x, picture.kind), channel_of(bits.y, picture.kind),
        channel_of(bits.z, picture.kind), channel_of(bits.w, picture.kind));
}

// Where texels are that an axis of an image is read at: the first one's number, made one of the image's own or
// its mirror image's where these repeat; after how many it repeats; how far beyond a texel the place lies.
struct Axis { int first; int period; int size; float part; };

Axis axis_of(float place, int size, int texels, int extension) {
    float centred = texels == CLOSEST ? place : place - 0.5;
    int at = int(centred) - (centred < 0.0 ? 1 : 0);
    int period = extension == REPEAT ? size : extension == MIRROR ? 2 * size : 0;
    int first = texels == CUBIC ? at - 1 : at;
    if (period > 0) first = first >= 0 ? first % period : period - 1 - (-1 - first) % period;
    return Axis(first, period, size, centred - float(at));
}

// The number of a texel, so many from the first one; -1: there is none.
int texel_at(Axis axis, int step, int extension) {
    int at = axis.first + step;
    if (extension == EXTEND) return clamp(at, 0, axis.size - 1);
    if (extension == CLIP) return at < axis.size ? at : -1;
    while (at >= axis.period) at -= axis.period;
    return at < axis.size ? at : 2 * axis.size - 1 - at;
}

// What it weighs: by the uniform cubic B-spline, or evenly between the centres of two.
float texel_weight(float part, int step, int texels) {
    if (texels == CLOSEST) return 1.0;
    if (texels == LINEAR) return step == 0 ? 1.0 - part : part;
    float far = abs(float(step - 1) - part), beyond = 2.0 - far;
    return far < 1.0 ? 2.0 / 3.0 - far * far * (1.0 - 0.5 * far) : beyond * beyond * beyond / 6.0;
}

// An image at a place, where it covers the unit square: colour and alpha, as they are stored. `texels` are known
// only when this runs, for a loop that compilers write out is long to compile.
vec4 sample_picture(Picture picture, vec2 uv, int texels, int extension) {
    vec2 place = uv * vec2(picture.size);
    if (any(isnan(place)) || any(greaterThan(abs(place), vec2(1.0e9)))) return vec4(0.0);
    Axis across = axis_of(place.x, picture.size.x, texels, extension);
    Axis along = axis_of(place.y, picture.size.y, texels, extension);
    vec4 sum = vec4(0.0);
    int i = 0, j = 0;
    for (int count = texels * texels; count > 0; count--) {
        ivec2 at = ivec2(texel_at(across, i, extension), texel_at(along, j, extension));
        float weight = texel_weight(across.part, i, texels) * texel_weight(along.part, j, texels);
        if (at.x >= 0 && at.y >= 0) sum += weight * texel_of(picture, at);
        i++;
        if (i == texels) { i = 0; j++; }
    }
    return (picture.kind & HAS_FOUR) == 0 ? vec4(sum.xyz, 1.0) : sum;
}

vec3 decoded_srgb(vec3 coded) {
    vec3 c = max(coded, 0.0);
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

// Colour and alpha in linear light; `separated`: the colour is not multiplied by alpha.
vec4 sample_image(int image, vec2 uv, int texels, int extension, bool separated) {
    Picture picture = picture_at(image);
    vec4 found = sample_picture(picture, uv, texels, extension);
    if (separated && found.w != 0.0 && found.w != 1.0) found.xyz /= found.w;
    if ((picture.kind & IS_SRGB) != 0) found.xyz = decoded_srgb(found.xyz);
    return found;
}
