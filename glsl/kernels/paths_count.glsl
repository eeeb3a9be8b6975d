// SPDX-License-Identifier: GPL-3.0-or-later
// Count the photons that are alive.
#include "lib/compaction.glsl"
#include "lib/under_way.glsl"

void main() { count_block(); }
