// SPDX-License-Identifier: GPL-3.0-or-later
// The mean of an image over the pixels to both sides of each, as far as there are.

void kernel() {
    int at = along.x * element().x + along.y * element().y;
    int last = along.x * stream_size.x + along.y * stream_size.y - 1;
    int first = max(at - reach, 0), end = min(at + reach, last);
    vec4 sum = vec4(0.0);
    for (int i = first; i <= end; i++) sum += texelFetch(image, element() + (i - at) * along, 0);
    store_mean(Sum(sum / float(end - first + 1)));
}
