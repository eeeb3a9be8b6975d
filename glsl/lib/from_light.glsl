// SPDX-License-Identifier: GPL-3.0-or-later
// The source of a ray that left no triangle but a light: below 0, as that of one that left nothing. A half less: it has
// passed what lets it through since.
float from_light(int number) { return -1.0 - float(number); }
bool is_from_light(RayOrigin origin) { return origin.source < 0.0; }
int light_of(RayOrigin origin) { return -1 - int(origin.source); }
bool has_passed(RayOrigin origin) { return fract(origin.source) != 0.0; }
RayOrigin passed_on(RayOrigin from, vec3 to) { return RayOrigin(to, float(int(from.source)) - 0.5); }
