// SPDX-License-Identifier: GPL-3.0-or-later
// Take from secondary rays what was absorbed on their way.
#include "lib/absorption.glsl"

void kernel() {
    Throughput chain = load_throughput();
    Hit hit = load_hit();
    if (is_hit(hit)) chain.throughput *= left_by_absorption(load_medium(), hit, load_facing().side);
    store_left(chain);
}
