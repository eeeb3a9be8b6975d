// SPDX-License-Identifier: GPL-3.0-or-later
#include "lib/image.glsl"

void kernel() {
    vec4 query = load_query().value;
    store_value(Value(sample_image(int(query.z), query.xy, interpolation, extension, query.w > 0.0)));
}
