// SPDX-License-Identifier: GPL-3.0-or-later
// One ray a pixel through a common jitter of the pixel grid: splats then fall exactly on pixels.
// Where the camera has a LENS, each pixel's ray goes through another point of it.
#include "lib/eye_ray.glsl"
#include "made/camera.glsl"
#ifdef LENS
#include "lib/lens.glsl"
#include "lib/pixel.glsl"
#include "lib/rng.glsl"
#endif

void kernel() {
    vec2 pixel = vec2(element() + region_origin);
    EyeRay ray = ray_camera(mix(window.xz, window.yw, (pixel + jitter) / vec2(frame_size)));
    float stretch = length(ray.direction);  // clip distances are along the view axis, rays are not
    if (stretch == 0.0) skip();
    vec3 local = ray.direction / stretch;
#ifdef LENS
    vec2 start = random4(seed, 0u, uint(pixel_number(pixel)), DIMENSION_LENS).xy;
    vec2 p = lens.x * sample_aperture(second_sequence(start, pass_index), blades, lens.y) * vec2(lens.z, 1.0);
    vec3 on_lens = p.x * ray.lens_x + p.y * ray.lens_y;
    local = normalize(ray.direction * focus - on_lens);
    ray.start += on_lens;
#endif
    store_pixel(Pixel(pixel));
    vec3 direction = mat3(camera) * local;
    vec3 origin = (camera * vec4(ray.start, 1.0)).xyz + direction * (clip.x * stretch);
    store_origin(RayOrigin(origin, -1.0));
    store_direction(RayDirection(direction, min((clip.y - clip.x) * stretch, T_MAX)));
}
