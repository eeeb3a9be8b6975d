// SPDX-License-Identifier: GPL-3.0-or-later
// The world by an image of all directions, as Blender's Environment Texture has it: longitude across, latitude from
// the lowest row up, and interpolated between the centres of pixels. The light's axis is up in the image, and its
// middle column lies across. Directions are drawn by the image, or by the cosine, half of them each.
// Parameters: bounds [scene], image [image]. Power: W/(m^2 sr).
#include "lib/colour.glsl"
#include "lib/environment.glsl"
#include "lib/sampling.glsl"

Environment environment_of(Light light) {
    return environment_at(light.parameters.y, light.parameters.z, light.parameters.w);
}

float up_to_row(Environment image, int row) { return row < 0 ? 0.0 : environment_texel(image.rows + row).x; }

float up_to_pixel(Environment image, int row, int column) {
    return column < 0 ? 0.0 : environment_texel(image.pixels + row * image.width + column).w;
}

mat3 frame_of_environment(Light light) { return mat3(light.across, cross(light.axis, light.across), light.axis); }

Around around(Environment image, Light light, vec3 direction) {
    return around(image, direction * frame_of_environment(light));
}

vec3 environment_radiance(Light light, vec3 direction) {
    Around found = around(environment_of(light), light, direction);
    return light.power * mix(found.low, found.high, found.part);
}

float solid_angle_of_row(Environment image, int row) {
    int inside = clamp(row, 0, image.height - 1);
    // The difference of two sines of latitude is a product.
    float height = 2.0 * sin(PI * (float(inside) + 0.5) / float(image.height)) * sin(0.5 * PI / float(image.height));
    return height * 2.0 * PI / float(image.width);
}

// The density of directions drawn by the image [1/sr]: of pixels by luminance times solid angle, and about each
// as its radiance is interpolated, so that where light is bright it is nearly even over its density.
float pdf_by_image(Light light, vec3 direction, Environment image, Around found) {
    float total = luminance(environment_texel(image.rows - 1).rgb);
    if (!(total > 0.0)) return 0.0;
    float low = luminance(found.low) * solid_angle_of_row(image, found.row);
    float high = luminance(found.high) * solid_angle_of_row(image, found.row + 1);
    float across = length(direction - dot(direction, light.axis) * light.axis);
    float pixels = float(image.width * image.height) / (2.0 * PI * PI * max(across, 1.0e-6));  // a steradian
    return mix(low, high, found.part) / total * pixels;
}

float pdf_by_image(Light light, vec3 direction) {
    Environment image = environment_of(light);
    return pdf_by_image(light, direction, image, around(image, light, direction));
}

// A number in (-1, 1) by a tent's density.
float sample_tent(float u) { return u < 0.5 ? sqrt(2.0 * u) - 1.0 : 1.0 - sqrt(2.0 - 2.0 * u); }

// A direction with that density.
vec3 sample_by_image(Light light, vec2 u) {
    Environment image = environment_of(light);
    int row = 0, last = image.height - 1;
    while (row < last) {
        int middle = (row + last) / 2;
        if (u.y < up_to_row(image, middle)) last = middle; else row = middle + 1;
    }
    int column = 0;
    last = image.width - 1;
    while (column < last) {
        int middle = (column + last) / 2;
        if (u.x < up_to_pixel(image, row, middle)) last = middle; else column = middle + 1;
    }
    vec2 begin = vec2(up_to_pixel(image, row, column - 1), up_to_row(image, row - 1));
    vec2 end = vec2(up_to_pixel(image, row, column), up_to_row(image, row));
    vec2 within = clamp((u - begin) / max(end - begin, 1.0e-30), 0.0, 1.0);
    float x = float(column) + 0.5 + sample_tent(within.x), y = abs(float(row) + 0.5 + sample_tent(within.y));
    y = min(y, 2.0 * float(image.height) - y);  // the outermost rows go on to the poles
    float turn = 2.0 * PI * (0.5 - x / float(image.width)), up = PI * (y / float(image.height) - 0.5);
    vec3 local = vec3(cos(up) * cos(turn), cos(up) * sin(turn), sin(up));
    return frame_of_environment(light) * local;
}

float pdf_environment(Light light, vec3 position, vec3 normal, vec3 to_light) {
    return 0.5 * pdf_by_image(light, to_light) + 0.5 * pdf_cosine_hemisphere(dot(normal, to_light));
}

LightSample sample_environment(Light light, vec3 position, vec3 normal, vec2 u) {
    vec3 to_light = u.x < 0.5 ? sample_by_image(light, vec2(2.0 * u.x, u.y))
        : frame_about(normal) * sample_cosine_hemisphere(vec2(2.0 * u.x - 1.0, u.y));
    Environment image = environment_of(light);
    Around found = around(image, light, to_light);
    float cosine = dot(normal, to_light);
    float density = 0.5 * pdf_by_image(light, to_light, image, found) + 0.5 * pdf_cosine_hemisphere(cosine);
    if (!(cosine > 0.0) || !(density > 0.0)) return LightSample(to_light, T_MAX, vec3(0.0), 0.0);
    return LightSample(to_light, T_MAX, light.power * mix(found.low, found.high, found.part) / density, 1.0);
}

vec4 seen_environment(Light light, vec3 origin, vec3 direction, float far) {
    return far >= T_MAX ? vec4(environment_radiance(light, direction), T_MAX) : vec4(0.0);
}

LightRay emit_environment(Light light, vec2 u, vec2 on_light) {
    return emitted_by_surroundings(-sample_by_image(light, u), on_light, light.parameters.x);
}

float area_of_bounds(Light light) { return PI * light.parameters.x * light.parameters.x; }

vec3 flux_environment(Light light) {
    Environment image = environment_of(light);
    return light.power * environment_texel(image.rows - 1).rgb * area_of_bounds(light);
}

vec3 carried_environment(Light light, vec3 direction) {
    float density = pdf_by_image(light, -direction);
    return density > 0.0 ? environment_radiance(light, -direction) * (area_of_bounds(light) / density) : vec3(0.0);
}
