// SPDX-License-Identifier: GPL-3.0-or-later
// What all that a lobe reflects is multiplied by: one number, or with TINTED one a channel, in the float of the
// stream. 9 bits a channel, of blue 8, and the exponent of the largest, which is rounded by 0.001 at most, as blue 0.002;
// as bits of a float that no device takes for 0 or for none. Far above 1 is what stands for others that are as much more.

#ifdef TINTED
const vec3 TINT_STEPS = vec3(511.0, 511.0, 255.0);
const float LEAST_TINT = -10.0;  // log2 of the least largest channel but one; 2^21 is the most

float packed_weight(vec3 weight) {
    float most = max(weight.r, max(weight.g, weight.b));
    if (!(most > 0.0)) return 0.0;
    float exponent = clamp(ceil(log2(most)), LEAST_TINT, LEAST_TINT + 31.0);
    uvec3 steps = uvec3(clamp(weight * exp2(-exponent), 0.0, 1.0) * TINT_STEPS + 0.5);
    uint code = (steps.r << 22) | (steps.g << 13) | (steps.b << 5) | uint(exponent - LEAST_TINT);
    // 31 bits: the sign, 7 of the 8 of the exponent, and the fraction; the exponent's first is the opposite of its
    // second, which keeps it from its ends.
    uint second = (code >> 29) & 1u;
    return uintBitsToFloat(((code >> 30) << 31) | ((1u - second) << 30) | (code & 0x3fffffffu));
}

vec3 unpacked_weight(float weight) {
    if (weight == 0.0) return vec3(0.0);
    uint bits = floatBitsToUint(weight), code = ((bits >> 31) << 30) | (bits & 0x3fffffffu);
    vec3 scale = exp2(float(code & 31u) + LEAST_TINT) / TINT_STEPS;
    return vec3((uvec3(code) >> uvec3(22, 13, 5)) & uvec3(0x1ffu, 0x1ffu, 0xffu)) * scale;
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
