// SPDX-License-Identifier: GPL-3.0-or-later
// Ways through media that differ from place to place, gone in steps as long as places of the finest grid are apart there,
// along each of which a medium goes evenly.
#ifdef PHOTONS
const float STEP = 2.0;  // times as far; where photons land is blurred anyway
#else
const float STEP = 1.0;
#endif
const float LEAST_STEPS = 4.0;
const float MOST_STEPS = 256.0;
const int STEPS_BEYOND = 32;  // the box about all, each longer than the one before

// Of a way: where steps begin, how long and how many they are; how many come after those, and how far all these reach, in
// lengths of one step; what media that are the same all through take evenly; and of `media` that differ the first one's
// grid, its number, and what it takes in the mean.
struct Steps {
    float begin; float size; float count; int beyond; float reach; vec3 even; vec3 mean; int media; float number; Grid grid;
};

// Of a whole way: where it is left before its end steps are the same.
Steps steps_along(vec2 inside, vec3 origin, vec3 direction, float way) {
    vec3 inverse = 1.0 / mix(direction, vec3(1.0e-20), equal(direction, vec3(0.0))), zero = vec3(0.0);
    float end = 0.0, finest = 0.0, reach = 0.0;
    Grid none = Grid(zero, 0.0, zero, 0.0, zero, 0.0, zero, 0.0);
    Steps steps = Steps(LONGEST, 1.0, 0.0, 0, 0.0, zero, zero, 0, 0.0, none);
    for (int i = 0; i < MOST_MEDIA; i++) {
        float number = medium_number(inside, i);
        if (!(number > 0.0)) continue;
        Interior one = interior_at(int(number) - 1);
        if (!(one.grid > 0.0)) {
            steps.even += one.extinction;
            continue;
        }
        Grid grid = grid_at(int(one.grid) - 1);
        if (++steps.media == 1) {
            steps.grid = grid;
            steps.number = one.grid;
            steps.mean = one.extinction;
        }
        vec3 low = (grid.low - origin) * inverse, high = (grid.high - origin) * inverse;
        vec3 near = min(low, high), far = max(low, high), finer = grid.finer * abs(direction);
        float enters = max(max(near.x, near.y), max(near.z, 0.0)), leaves = min(min(far.x, far.y), min(far.z, way));
        if (grid.goes_on > 0.0) enters = 0.0;  // it is there before its box, too
        if (leaves > enters) {
            steps.begin = min(steps.begin, enters);
            end = max(end, leaves);
            finest = max(finest, max(finer.x, max(finer.y, finer.z)));
        }
        if (grid.goes_on > 0.0) {
            Grid beyond = grid_at(int(one.grid));
            vec3 ends = 0.5 * (grid.high - grid.low) * exp(0.5 * (beyond.count - 1.0) / beyond.finer - WITHIN);
            reach = 2.0 * max(ends.x, max(ends.y, ends.z));
            steps.beyond = STEPS_BEYOND;
        }
    }
    if (end > steps.begin) {
        steps.count = clamp(ceil((end - steps.begin) * finest / STEP), LEAST_STEPS, MOST_STEPS);
        steps.size = (end - steps.begin) / steps.count;
    } else {
        steps.begin = 0.0;
        steps.size = max(1.0e-4 * reach, 1.0e-20);
    }
    steps.reach = max(reach / steps.size, 2.0);
    return steps;
}

// Where a step ends.
float step_end(Steps steps, int number) {
    float within = min(float(number), steps.count), after = (float(number) - within) / float(STEPS_BEYOND);
    return steps.begin + steps.size * (within + pow(steps.reach, after) - 1.0);
}

// What is lost at a place of the way.
vec3 lost_at(Steps steps, vec2 inside, vec3 place) {
    vec3 lost = steps.even;
    if (steps.media > 0) lost += steps.mean * voxel_between(steps.grid, steps.number, place, false);
    int met = 0;
    for (int i = 0; steps.media > 1 && i < MOST_MEDIA; i++) {
        float number = medium_number(inside, i);
        if (!(number > 0.0)) continue;
        Interior one = interior_at(int(number) - 1);
        if (one.grid > 0.0 && ++met > 1) lost += varied(one, place).extinction;
    }
    return lost;
}

// As far as `far` on a way, or until light of a channel has a depth behind it; below 0: of none. Behind the last step, and
// before the boxes where none goes on, nothing differs.
Gone gone_along(vec2 inside, vec3 origin, vec3 direction, float way, float far, int channel, float target) {
    Steps steps = steps_along(inside, origin, direction, way);
    far = min(far, LONGEST);
    int last = int(steps.count) + steps.beyond + 1;
    bool is_within = steps.begin == 0.0 || steps.beyond > 0;
    Gone gone;
    gone.t = 0.0;
    gone.depth = vec3(0.0);
    gone.extinction = is_within ? lost_at(steps, inside, origin) : steps.even;
#ifdef GLOWING
    gone.glow = vec3(0.0);
    vec3 even = emitted_at(inside, origin, true), emitted = is_within ? emitted_at(inside, origin, false) : even;
#endif
    for (int i = 0; i <= last && gone.t < far; i++) {
        float next = i == last ? far : min(step_end(steps, i), far);
        if (!(next > gone.t)) continue;
        bool is_even = i == last || (i == 0 && !is_within);
        vec3 before = is_even ? steps.even : gone.extinction;
        vec3 there = is_even ? steps.even : lost_at(steps, inside, origin + next * direction);
        float size = next - gone.t, wanted = channel < 0 ? LONGEST : target - gone.depth[channel];
        bool is_last = channel >= 0 && 0.5 * size * (before[channel] + there[channel]) >= wanted;
        if (is_last) {  // where the integral of what goes evenly is what is wanted
            float first = before[channel], more = (there[channel] - first) / size, way = 0.0;
            if (wanted > 0.0) way = 2.0 * wanted / (first + sqrt(max(first * first + 2.0 * more * wanted, 0.0)));
            way = clamp(way, 0.0, size);
            there = mix(before, there, way / size);
            size = way;
            next = gone.t + way;
        }
#ifdef GLOWING
        vec3 emits = is_even ? even : emitted, ends = is_even ? even : emitted_at(inside, origin + next * direction, false);
        gone.glow += exp(-gone.depth) * glow_between(emits, ends, before, there, size);
        emitted = ends;
#endif
        gone.depth += 0.5 * size * (before + there);
        gone.extinction = there;
        gone.t = next;
        if (is_last) break;
        if (i > 0 || is_within) continue;
        gone.extinction = lost_at(steps, inside, origin + next * direction);
#ifdef GLOWING
        emitted = emitted_at(inside, origin + next * direction, false);
#endif
    }
    return gone;
}
