// SPDX-License-Identifier: GPL-3.0-or-later
// A direction of the object's space in the world's.
// Operands: direction.
#include "lib/object_space.glsl"

vec4 run_in_world(vec4 direction) { return vec4(direction_in_world(direction.xyz), 1.0); }
