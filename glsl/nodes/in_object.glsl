// SPDX-License-Identifier: GPL-3.0-or-later
// A world space normal in the object's space, unit.
// Operands: normal.
#include "lib/object_space.glsl"

vec4 run_in_object(vec4 normal) { return vec4(normal_in_object(normal.xyz), 1.0); }
