// SPDX-License-Identifier: GPL-3.0-or-later
// An affine transform by its three rows.
// Operands: vector, x, y, z.

vec4 run_matrix(vec4 vector, vec4 x, vec4 y, vec4 z) {
    vec4 at = vec4(vector.xyz, 1.0);
    return vec4(dot(x, at), dot(y, at), dot(z, at), 1.0);
}
