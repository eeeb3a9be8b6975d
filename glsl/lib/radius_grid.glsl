// SPDX-License-Identifier: GPL-3.0-or-later
// Where the gather radii are made, as native/src/radius makes them: at the nodes of a grid for each of
// the six sides of surfaces. Photons are counted in cells half as wide.
uniform vec4 grids[24];  // a RadiusGrid for each side
uniform int most_a_side;  // elements: a side's are numbered from its number times so many

// Elements of a line that a thread reads before it writes any: it waits for memory once, not for each.
const int AT_ONCE = 16;

RadiusGrid grid_of(int side) {
    int at = 4 * side;
    return unpack_RadiusGrid(grids[at], grids[at + 1], grids[at + 2], grids[at + 3]);
}

ivec3 nodes_of(RadiusGrid grid) { return ivec3(grid.cells) + 1; }

// Which of all radii is a side's first.
int first_node(RadiusGrid grid) { return int(grid.first); }

// The corners of the cells in which photons are counted.
ivec3 corners_of(RadiusGrid grid) { return 2 * ivec3(grid.cells) + 1; }

int number_of(ivec3 n) { return n.x * n.y * n.z; }

// Which of all sides' corners is a side's first.
int first_corner(RadiusGrid grid) { return int(grid.first_corner); }

int index_in(ivec3 n, ivec3 at) { return (at.z * n.y + at.y) * n.x + at.x; }

ivec3 place_in(ivec3 n, int index) {
    return ivec3(index % n.x, index / n.x % n.y, index / (n.x * n.y));
}

// Which element the first of a line along an axis is, by the line's number, and how far it is to the next;
// false if there are fewer lines.
bool line_in(ivec3 n, int axis, int line, out int first, out int step, out int length) {
    int row = n.x, layer = n.x * n.y;
    if (axis == 0) { first = line * row; step = 1; length = n.x; return line < n.y * n.z; }
    if (axis == 1) { first = line / row * layer + line % row; step = row; length = n.y; return line < n.x * n.z; }
    first = line; step = layer; length = n.z;
    return line < layer;
}
