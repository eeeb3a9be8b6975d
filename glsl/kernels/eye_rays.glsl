// SPDX-License-Identifier: GPL-3.0-or-later
// One ray a pixel. Where the camera has a LENS, each goes through another point of it.
#include "lib/eye_ray.glsl"
#include "made/camera.glsl"
#include "lib/pixel.glsl"
#include "lib/pixel_filter.glsl"
#ifdef LENS
#include "lib/lens.glsl"
#endif

void kernel() {
    vec2 pixel = vec2(element_of_part() + region_origin);
    vec4 place = place_in_pixel(seed, pass_index, uint(pixel_number(pixel)));
    vec2 offset = pixel_filter_width * vec2(pixel_filter_offset(place.x), pixel_filter_offset(place.y));
    EyeRay ray = ray_camera(mix(window.xz, window.yw, (pixel + 0.5 + offset) / vec2(frame_size)));
    float stretch = length(ray.direction);  // clip distances are along the view axis, rays are not
    if (stretch == 0.0) skip();
    vec3 local = ray.direction / stretch;
#ifdef LENS
    vec2 p = lens.x * sample_aperture(place.zw, blades, lens.y) * vec2(lens.z, 1.0);
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
