// SPDX-License-Identifier: GPL-3.0-or-later
// One ray a pixel through a common jitter of the pixel grid: splats then fall exactly on pixels.
#include "lib/constants.glsl"

void kernel() {
    vec2 at = (vec2(element() + region_origin) + jitter) / vec2(frame_size);
    vec2 p = mix(window.xz, window.yw, at);
    vec3 local = orthographic ? vec3(0.0, 0.0, -1.0) : vec3(p, -1.0);
    vec3 start = orthographic ? vec3(p, 0.0) : vec3(0.0);
    float stretch = length(local);  // clip distances are along the view axis, rays are not
    vec3 direction = mat3(camera) * (local / stretch);
    vec3 origin = (camera * vec4(start, 1.0)).xyz + direction * (clip.x * stretch);
    store_origin(RayOrigin(origin, -1.0));
    store_direction(RayDirection(direction, min((clip.y - clip.x) * stretch, T_MAX)));
}
