// SPDX-License-Identifier: GPL-3.0-or-later
// The colour of a temperature [K].
#include "nodes/blackbody.glsl"

void kernel() {
    store_value(Value(run_blackbody(load_temperature().value)));
}
