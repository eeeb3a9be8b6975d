// SPDX-License-Identifier: GPL-3.0-or-later
// What the float fields of the streams' records mean, besides what their names say.

// A hit holds its triangle's number plus one: zero is a miss. Exact below 2^24.
bool is_hit(Hit hit) { return hit.triangle > 0.0; }
int hit_triangle(Hit hit) { return int(hit.triangle) - 1; }
