// SPDX-License-Identifier: GPL-3.0-or-later
// Points whose material lets light through to the viewer from behind: every other pass's shadow rays go there. Uses
// the tables of triangles and materials.
#include "lib/constants.glsl"
#include "lib/triangle.glsl"

// The share of a triangle's shadow rays that go to the side of a light.
float share_of_side(int triangle) {
#ifdef SCATTERING
    if (triangle == int(NO_TRIANGLE)) return 1.0;  // a medium's point
#endif
    return material_at(int(triangle_at(triangle).material)).two_sided > 0.0 ? 0.5 : 1.0;
}
