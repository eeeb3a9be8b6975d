// SPDX-License-Identifier: GPL-3.0-or-later
// Sums over the threads of a work group of 256, each of which has PER_THREAD consecutive elements.
const int PER_THREAD = 4;
shared uint partial[256];

int first_element() { return (group() * 256 + int(gl_LocalInvocationID.x)) * PER_THREAD; }

// The sum over the threads up to this one (Hillis & Steele 1986).
uint sum_up_to_here(uint own) {
    int local = int(gl_LocalInvocationID.x);
    barrier();  // others may still read the last one
    partial[local] = own;
    barrier();
    for (int step = 1; step < 256; step *= 2) {
        uint before = local >= step ? partial[local - step] : 0u;
        barrier();
        partial[local] += before;
        barrier();
    }
    return partial[local];
}

// The sum over all threads, after sum_up_to_here.
uint sum_of_group() { return partial[255]; }
