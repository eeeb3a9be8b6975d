// SPDX-License-Identifier: GPL-3.0-or-later
// What the corners of triangles have, interpolated: the attribute of a number. ATTRIBUTES is how many there are.
// Operands: [number].

vec4 run_attribute(vec4 number) {
#ifdef ATTRIBUTES
    CornerAttribute at = corner_attribute_at(here.triangle * ATTRIBUTES + int(number.x));
    return here.corners.x * at.a + here.corners.y * at.b + here.corners.z * at.c;
#else
    return vec4(0.0);
#endif
}
