// SPDX-License-Identifier: GPL-3.0-or-later
// The source of a ray that left no triangle but a light: below 0, as that of one that left nothing.

float from_light(int number) { return -1.0 - float(number); }
bool is_from_light(RayOrigin origin) { return origin.source < 0.0; }
int light_of(RayOrigin origin) { return -1 - int(origin.source); }
