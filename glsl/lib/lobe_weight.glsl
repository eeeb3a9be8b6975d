// SPDX-License-Identifier: GPL-3.0-or-later
// What all that a lobe reflects is multiplied by: one number, or with TINTED one a channel, in the float of the
// stream. 9 bits a channel and an exponent of the largest, which is rounded by 0.002 of itself between 1 / 64 and 32, and
// above, where it stands for others that are as much more, by 0.008; as bits of a float that no device takes for 0 or for
// none.

#ifdef TINTED
const float TINT_STEPS = 511.0;
const float LEAST_TINT = -6.0;  // log2
const float EACH_TINT = 5.0;    // up to here there is an exponent for each, then for every third: 2^17 is the most
const float TINT_CODES = EACH_TINT - LEAST_TINT;

float exponent_of_tint(float code) { return min(code + LEAST_TINT, EACH_TINT) + 3.0 * max(code - TINT_CODES, 0.0); }

float packed_weight(vec3 weight) {
    float most = max(weight.r, max(weight.g, weight.b));
    if (!(most > 0.0)) return 0.0;
    float exponent = ceil(log2(most)), above = ceil(max(exponent - EACH_TINT, 0.0) / 3.0);
    float which = clamp(min(exponent, EACH_TINT) - LEAST_TINT + above, 0.0, 15.0);
    uvec3 steps = uvec3(clamp(weight * exp2(-exponent_of_tint(which)), 0.0, 1.0) * TINT_STEPS + 0.5);
    uint code = (steps.r << 22) | (steps.g << 13) | (steps.b << 4) | uint(which);
    // 31 bits: the sign, 7 of the 8 of the exponent, and the fraction; the exponent's first is the opposite of its
    // second, which keeps it from its ends.
    uint second = (code >> 29) & 1u;
    return uintBitsToFloat(((code >> 30) << 31) | ((1u - second) << 30) | (code & 0x3fffffffu));
}

vec3 unpacked_weight(float weight) {
    if (weight == 0.0) return vec3(0.0);
    uint bits = floatBitsToUint(weight), code = ((bits >> 31) << 30) | (bits & 0x3fffffffu);
    float scale = exp2(exponent_of_tint(float(code & 15u))) / TINT_STEPS;
    return vec3((uvec3(code) >> uvec3(22, 13, 4)) & 0x1ffu) * scale;
}
#else
float packed_weight(vec3 weight) { return weight.r; }
vec3 unpacked_weight(float weight) { return vec3(weight); }
#endif

vec3 weight_of(Shape shape) { return unpacked_weight(shape.weight); }
bool has_weight(Shape shape) { return shape.weight != 0.0; }

// The same lobe, all of it multiplied by something.
Shape weighed(Shape shape, vec3 by) { return Shape(shape.parameters, packed_weight(weight_of(shape) * by)); }
Shape weighed(Shape shape, float by) { return weighed(shape, vec3(by)); }
