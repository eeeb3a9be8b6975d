// SPDX-License-Identifier: GPL-3.0-or-later
// What media emit on a ray's way. Uses the table of glows.

// Optical depths below which what is lost on a way is told by a series.
const float SHORT = 1.0e-2;

// Of what is emitted evenly along a way of a length 1 and an optical depth, what is left where it begins, and of what grows
// from 0 to 1 on it.
vec2 left_of_glow(float depth) {
    if (depth < SHORT) return vec2(1.0 - depth * (0.5 - depth / 6.0), 0.5 - depth * (1.0 / 3.0 - depth / 8.0));
    float left = exp(-depth), even = (1.0 - left) / depth;
    return vec2(even, (even - left) / depth);
}

// Into how many parts steps are cut, in each of which as much is lost anywhere.
const int PARTS = 4;

// What is left at a place of what is emitted from there to one at this distance, where so much is emitted and lost, which
// goes evenly between both.
vec3 glow_between(vec3 emitted, vec3 emitted_there, vec3 lost, vec3 lost_there, float distance) {
    int parts = lost == lost_there ? 1 : PARTS;
    float size = distance / float(parts);
    vec3 glow = vec3(0.0), depth = vec3(0.0), more = (emitted_there - emitted) / float(parts);
    for (int part = 0; part < parts; part++) {
        vec3 own = size * mix(lost, lost_there, (float(part) + 0.5) / float(parts)), left;
        for (int i = 0; i < 3; i++) {
            vec2 of_both = left_of_glow(own[i]);
            left[i] = emitted[i] * of_both.x + more[i] * (float(part) * of_both.x + of_both.y);
        }
        glow += exp(-depth) * left;
        depth += own;
    }
    return size * glow;
}

// What media emit at a place [radiance a scene unit]; `is_even`: those that are the same all through.
vec3 emitted_at(vec2 inside, vec3 place, bool is_even) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < MOST_MEDIA; i++) {
        float number = medium_number(inside, i);
        if (!(number > 0.0)) continue;
        Glow glow = glow_at(int(number) - 1);
#ifdef VARYING
        if (glow.first >= 0.0) {
            if (is_even || glow.emission == vec3(0.0)) continue;
            Grid grid = grid_at(int(interior_at(int(number) - 1).grid) - 1);
            vec3 last = grid.count - 1.0, at = (place - grid.low) * grid.finer, within = clamp(at, vec3(0.0), last);
            if (largest(abs(at - within)) > 1.0) continue;  // as far as rounding may be
            glow.emission *= voxels_about(grid, int(glow.first), 3, within);
        }
#endif
        sum += glow.emission;
    }
    return sum;
}
