// SPDX-License-Identifier: GPL-3.0-or-later
// What the items of a part have drawn, to be blended to the sum of those before it.
void kernel() { store_sum(load_part()); }
