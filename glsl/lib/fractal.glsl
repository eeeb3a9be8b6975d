// SPDX-License-Identifier: GPL-3.0-or-later
// Sums of octaves of noise (Ebert et al., "Texturing and Modeling", Musgrave's chapters) as Cycles' Noise Texture has
// them. One loop for all kinds, which differ in what an octave adds.
#include "lib/perlin.glsl"

const int FRACTAL_FBM = 0;
const int FRACTAL_MULTIFRACTAL = 1;
const int FRACTAL_HYBRID = 2;
const int FRACTAL_RIDGED = 3;
const int FRACTAL_HETERO_TERRAIN = 4;

struct Fractal {
    int kind;
    bool normalized;  // fBM alone: in [0, 1]
    float detail;  // octaves after the first, in [0, 15]; of the last its fraction
    float roughness;  // what each octave's amplitude is of the one's before, >= 0
    float lacunarity;  // what each octave's frequency is of the one's before
    float offset, gain;
};

struct Octaves {
    float value, normal;  // the sum; for fBM also what it is when normalized
    float amplitude, total;  // of the next octave; of those before
    float weight;  // what earlier octaves leave to the next one
};

Octaves no_octaves(Fractal fractal) {
    return Octaves(fractal.kind == FRACTAL_MULTIFRACTAL ? 1.0 : 0.0, 0.0, 1.0, 0.0, 1.0);
}

// With an octave more, of which `share` counts.
Octaves with_octave(Octaves sum, Fractal fractal, float noise, float share, bool first) {
    float amplitude = sum.amplitude, scaled = (noise + fractal.offset) * amplitude;
    if (fractal.kind == FRACTAL_FBM) {
        sum.value += share * noise * amplitude;
        sum.total += amplitude;
        // The fraction of an octave is mixed after normalizing: nothing remains of it to sum.
        float whole = sum.value + (1.0 - share) * noise * amplitude;
        sum.normal = mix(sum.normal, 0.5 * whole / sum.total + 0.5, share);
    } else if (fractal.kind == FRACTAL_MULTIFRACTAL) {
        sum.value *= share * noise * amplitude + 1.0;
    } else if (fractal.kind == FRACTAL_HYBRID) {
        if (sum.weight > 0.001) {
            float weight = min(sum.weight, 1.0);
            sum.value += share * weight * scaled;
            sum.weight = weight * fractal.gain * scaled;
        }
    } else if (fractal.kind == FRACTAL_RIDGED) {
        float ridge = fractal.offset - abs(noise), signal = ridge * ridge * sum.weight;
        sum.value += signal * amplitude;
        sum.weight = clamp(signal * fractal.gain, 0.0, 1.0);
    } else {
        sum.value += share * scaled * (first ? 1.0 : sum.value);
    }
    sum.amplitude *= fractal.roughness;
    return sum;
}

// Coordinates beyond `dimensions` are 0.
float fractal_noise(vec4 place, Fractal fractal, int dimensions) {
    Octaves sum = no_octaves(fractal);
    int whole = int(fractal.detail);
    float rest = fract(fractal.detail);
    int last = rest > 0.0 && fractal.kind != FRACTAL_RIDGED ? whole + 1 : whole;
    float frequency = 1.0;
    int i = 0;
    do {
        float noise = signed_noise(place * frequency, dimensions);
        sum = with_octave(sum, fractal, noise, i <= whole ? 1.0 : rest, i == 0);
        // As Cycles rounds: of fBM alone the frequency is multiplied up, of others the place.
        if (fractal.kind == FRACTAL_FBM) frequency *= fractal.lacunarity; else place *= fractal.lacunarity;
    } while (++i <= last);
    return fractal.kind == FRACTAL_FBM && fractal.normalized ? sum.normal : sum.value;
}
