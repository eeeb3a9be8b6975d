// SPDX-License-Identifier: GPL-3.0-or-later
// Tables are textures TABLE_WIDTH texels wide, read as one long array.
const int TABLE_WIDTH = 4096;

ivec2 table_texel(int index) { return ivec2(index & (TABLE_WIDTH - 1), index >> 12); }
