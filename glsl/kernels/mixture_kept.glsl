// SPDX-License-Identifier: GPL-3.0-or-later
// How much of the plain picture is kept by what speaks for it, less what may be chance.

// Of what is told to speak for the plain picture, so many standard errors count as chance.
const float SURE = 3.0;
// Where denoising gains less than this share of how far it moves the picture, less counts as chance.
const float LEAST_GAIN = 0.25;

float over(float a, float b) { return b > 0.0 ? a / b : 0.0; }

// How many lines there are within reach of one.
int within(int line, int count) { return min(line + reach + 1, count) - max(line - reach, 0); }

// A mean, less the more uncertain it is: else, where noise is strong, chance alone would keep some of it.
float shrunk(float mean, float error) { return max(0.0, mean - over(error * error, max(0.0, mean))); }

void kernel() {
    vec4 told = load_told().value;
    float noise = told.x, gained = told.y, apart = told.z, of_plain = apart - gained;
    float sure = clamp(over(gained, noise), 0.0, 1.0) * clamp(over(gained, apart) / LEAST_GAIN, 0.0, 1.0);
    int pixels = within(element().x, stream_size.x) * within(element().y, stream_size.y);
    float error = SURE * sure * sqrt(max(0.0, told.w - of_plain * of_plain) / float(pixels));
    store_kept(Sum(vec4(apart > 0.0 ? clamp(shrunk(of_plain, error) / apart, 0.0, 1.0) : 1.0, 0.0, 0.0, 0.0)));
}
