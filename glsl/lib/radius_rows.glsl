// SPDX-License-Identifier: GPL-3.0-or-later
// Lines along x, whose elements lie one after the other: THREADS share one, each has up to MOST_A_THREAD that
// lie side by side (addon/photon/photons/device_radii.py). A thread a line, as along y and z, would read and write far
// from what the next thread does.
#include "lib/radius_grid.glsl"

struct Share {
    int at;  // which of all elements its line's first one is
    int own;  // which of the line's threads it is
    int each;  // elements of every thread but the last
    int first;  // its first of the line
    int here;  // how many it has
    int all;  // how many the line has
};

Share share_of(ivec3 n, int line, int first_of_side) {
    int at = 0, step, length = 0;
    if (thread() >= count || !line_in(n, 0, line, at, step, length)) length = 0;
    int own = thread() % THREADS, each = (length + THREADS - 1) / THREADS;
    return Share(first_of_side + at, own, each, own * each, clamp(length - own * each, 0, each), length);
}
