// SPDX-License-Identifier: GPL-3.0-or-later
// The density of directions about +Z at a cosine.
#include "lib/sampling.glsl"

void kernel() {
    store_value(Value(vec4(pdf_cosine_hemisphere(load_at().value.x))));
}
