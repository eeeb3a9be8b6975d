// SPDX-License-Identifier: GPL-3.0-or-later
// What media are at places, of those that differ. Uses the tables of grids and voxels.

const float WITHIN = 3.0;  // stage/far.py

// Where a place is in what is beyond a box, as stage/far.py counts.
vec3 warped(Grid box, vec3 place) {
    vec3 from = (2.0 * place - box.low - box.high) / (box.high - box.low), size = abs(from);
    return sign(from) * mix(WITHIN * size, WITHIN + log(max(size, vec3(1.0))), greaterThan(size, vec3(1.0)));
}

// How far a face may be missed, of the way between two places, and of the way to a place from the middle of the scene.
const float ROUNDED = 0.01;
const float ROUNDED_AFAR = 4.0e-7;

// What is at a place in numbers of a grid's, evenly between its own; which voxel is the first of how many channels.
vec3 voxels_about(Grid grid, int voxel, int channels, vec3 at) {
    vec3 last = grid.count - 1.0, found = vec3(0.0), below = min(floor(at), last - 1.0), part = at - below;
    int row = int(grid.count.x), layer = row * int(grid.count.y);
    voxel += (int(below.z) * layer + int(below.y) * row) + int(below.x);
    for (int i = 0; i < channels; i++) {
        vec4 both = mix(voxel_at(voxel).values, voxel_at(voxel + layer).values, part.z);
        vec2 ends = mix(both.xy, both.zw, part.y);
        found[i] = mix(ends.x, ends.y, part.x);
        voxel += layer * int(grid.count.z);
    }
    return found;
}

// What a grid of a number, above 0, has at a place, or what is beyond it; of one without such nothing. `scattered`: what is
// scattered, not what is lost.
vec3 voxel_between(Grid grid, float number, vec3 place, bool scattered) {
    vec3 last = grid.count - 1.0, at = (place - grid.low) * grid.finer;
    vec3 rounded = max(vec3(ROUNDED), ROUNDED_AFAR * abs(place) * grid.finer);
    if (at != clamp(at, -rounded, last + rounded)) {
        if (!(grid.goes_on > 0.0)) return vec3(0.0);
        vec3 beyond = warped(grid, place);
        grid = grid_at(int(number));
        last = grid.count - 1.0;
        at = beyond * grid.finer + 0.5 * last;
        if (at != clamp(at, vec3(0.0), last)) return vec3(0.0);
    }
    int voxel = int(scattered && grid.first_scattering >= 0.0 ? grid.first_scattering : grid.first);
    vec3 found = voxels_about(grid, voxel, int(grid.channels), clamp(at, vec3(0.0), last));
    return grid.channels < 2.0 ? found.xxx : found;
}

// What a medium is at a place, whose values are means.
Interior varied(Interior mean, vec3 place) {
    Grid grid = grid_at(int(mean.grid) - 1);
    vec3 lost = voxel_between(grid, mean.grid, place, false);
    vec3 scattered = voxel_between(grid, mean.grid, place, true);
    return Interior(mean.extinction * lost, mean.anisotropy, mean.scattering * scattered, mean.grid, mean.unshadowing);
}
