// SPDX-License-Identifier: GPL-3.0-or-later
// The cells' starts as the table that gather.glsl reads.
#include "lib/table.glsl"
layout(std430, binding = 0) readonly buffer Starts { uint starts[]; };
layout(r32ui, binding = 0) writeonly uniform uimage2D cell_start;

void main() {
    int i = thread();
    if (i < count) imageStore(cell_start, table_texel(i), uvec4(starts[i]));
}
