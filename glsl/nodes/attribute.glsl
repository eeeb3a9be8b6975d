// SPDX-License-Identifier: GPL-3.0-or-later
// What the corners of triangles have, interpolated: the attribute of a number. ATTRIBUTES is how many there are.
// `shift`: where, see shifted_corners; with a third number what it changes.
// Operands: [number], [shift].

vec4 run_attribute(vec4 number, vec4 shift) {
#ifdef ATTRIBUTES
    CornerAttribute at = corner_attribute_at(shading_point.triangle * ATTRIBUTES + int(number.x));
    vec3 corners = shifted_corners(shift) - shift.z * shading_point.corners;
    return corners.x * at.a + corners.y * at.b + corners.z * at.c;
#else
    return vec4(0.0);
#endif
}
