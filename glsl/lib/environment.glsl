// SPDX-License-Identifier: GPL-3.0-or-later
// Images of all directions, longitude across, latitude from the lowest row up, interpolated between the centres of
// pixels. Uses the table of environments.
#include "lib/table.glsl"

// An image in the table of environments: what it emits in all, a texel a row with the share of photons that
// start in this row and those below it, then the pixels, with the share in this one and those before it in its row.
struct Environment { int rows; int pixels; int width; int height; };

// By the row of the table that it begins at.
Environment environment_at(float row, float width, float height) {
    int first = int(row) * TABLE_WIDTH;
    return Environment(first + 1, first + 1 + int(height), int(width), int(height));
}

vec4 environment_texel(int index) { return texelFetch(environments, table_texel(index), 0); }

vec3 pixel_radiance(Environment image, int row, int column) {
    int inside = clamp(row, 0, image.height - 1), around = (column + image.width) % image.width;
    return environment_texel(image.pixels + inside * image.width + around).rgb;
}

// Where a direction is in the image, in pixels from its lower left corner: z is up, and x in the middle.
vec2 place_in(Environment image, vec3 local) {
    float up = atan(local.z, length(local.xy));
    float turn = local.x == 0.0 && local.y == 0.0 ? 0.0 : atan(local.y, local.x);
    return vec2(0.5 - turn / (2.0 * PI), 0.5 + up / PI) * vec2(image.width, image.height);
}

// What lies about a place: interpolated across below and above it, the row below, and how far above that it is.
struct Around { vec3 low; vec3 high; int row; float part; };

Around around(Environment image, vec2 pixels) {
    vec2 place = pixels - 0.5, part = fract(place);
    ivec2 at = ivec2(floor(place));
    vec3 low = mix(pixel_radiance(image, at.y, at.x), pixel_radiance(image, at.y, at.x + 1), part.x);
    vec3 high = mix(pixel_radiance(image, at.y + 1, at.x), pixel_radiance(image, at.y + 1, at.x + 1), part.x);
    return Around(low, high, at.y, part.y);
}

Around around(Environment image, vec3 local) { return around(image, place_in(image, local)); }
