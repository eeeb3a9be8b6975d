// SPDX-License-Identifier: GPL-3.0-or-later
// What noise and blur add to the relative square of each pixel: film/error.py on the device. All light is
// counted in units of what is taken for dark, so that no square leaves float32.
#include "lib/colour.glsl"

vec3 over(vec3 a, vec3 b) { return mix(vec3(0.0), a / b, greaterThan(b, vec3(0.0))); }
float over(float a, float b) { return b > 0.0 ? a / b : 0.0; }

void kernel() {
    vec3 value = load_picture().value.rgb * unit;
    vec4 combined = load_combined().value / passes * unit;
    vec4 variance = load_squares().value * unit * unit * of_squares;
    // The picture divides indirect light by the coverage; so are its deviations divided.
    vec3 ratio = over(value, combined.rgb);
    vec3 squares = ratio * ratio * variance.rgb, square = value * value;
    vec3 scale = 1.0 / (max(square - squares, LEAST_SQUARE * square) + 1.0);
    float noise = dot(squares, scale) / 3.0, change = 0.0;
    bool lit = false, even = false;
#ifdef BLURRED
    vec4 direct = load_direct().value / passes, indirect = load_indirect().value / passes;
    vec4 blur = load_blur().value / passes;
    float weight = direct.a, covered = indirect.a;
    vec3 light = indirect.rgb;
#ifdef MIRRORED
    vec4 mirror_indirect = load_mirror_indirect().value / passes;
    weight += load_mirror().value.a / passes;
    covered += mirror_indirect.a;
    light += mirror_indirect.rgb;
#endif
    float on_surface = over(covered, weight), share = max(on_surface, LEAST_COVERAGE);
    // What is nearer is no less covered, and no filter here weighs it more than twice as much.
    float inner_share = clamp(over(blur.y, weight), share, share / INNER_AREA), inner = blur.x * unit;
    float outer = (combined.a + inner) / share - inner / inner_share;
    vec3 colour = over(light, vec3(mean(light)));
    change = (outer * outer - variance.a / (share * share)) * dot(colour * colour, scale) / 3.0;
    lit = on_surface > 0.0;
    even = on_surface >= EVEN;
#endif
    store_parts(Sum(vec4(noise, change, even ? change : 0.0, float(lit) + EVEN_COUNTS * float(even))));
}
