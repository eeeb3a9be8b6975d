// SPDX-License-Identifier: GPL-3.0-or-later

float mean(vec3 v) { return (v.r + v.g + v.b) * (1.0 / 3.0); }

float largest(vec3 v) { return max(v.r, max(v.g, v.b)); }
