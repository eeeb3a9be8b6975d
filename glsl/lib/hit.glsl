// SPDX-License-Identifier: GPL-3.0-or-later
// A hit holds its triangle's number plus one: zero is a miss; below zero a medium scatters the ray there. Exact below 2^24.

bool is_hit(Hit hit) { return hit.triangle != 0.0; }
bool is_scattered(Hit hit) { return hit.triangle < 0.0; }
Hit scattered_hit(float t) { return Hit(t, -1.0, 0.0, 0.0); }
int hit_triangle(Hit hit) { return int(hit.triangle) - 1; }
float stored_triangle(int triangle) { return float(triangle) + 1.0; }
