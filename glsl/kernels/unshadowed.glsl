// SPDX-License-Identifier: GPL-3.0-or-later
// Add what shadow rays would bring to those visible points whose rays got through.
#include "lib/hit.glsl"

void kernel() {
    vec3 sum = load_sum().radiance;
#ifdef ILLUMINANCE
    float lux = load_lux_sum().lux;
#endif
    int rows = stream_size.y;
    for (int y = element().y; y < textureSize(shadow_hit, 0).y; y += rows) {
        ivec2 at = ivec2(element().x, y);
        if (is_hit(unpack_Hit(texelFetch(shadow_hit, at, 0)))) continue;
        sum += unpack_Radiance(texelFetch(unshadowed, at, 0)).radiance;
#ifdef ILLUMINANCE
        lux += unpack_Illuminance(texelFetch(unshadowed_lux, at, 0)).lux;
#endif
    }
    store_direct(Radiance(sum, 1.0));
#ifdef ILLUMINANCE
    store_illuminance(Illuminance(lux));
#endif
}
