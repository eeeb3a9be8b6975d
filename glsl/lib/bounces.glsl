// SPDX-License-Identifier: GPL-3.0-or-later
// How often a ray of the eye was scattered, and as what it asks programs of materials.
#ifdef PROGRAMS
#include "lib/shading_point.glsl"
#endif

float bounces_before() {
#ifdef TRANSPARENT
    return load_chain().bounces;
#else
    return float(depth);
#endif
}

#ifdef PROGRAMS
void ask_as_eye_ray() {
    scattered = bounces_before();
    asking = scattered > 0.0 ? GLOSSY_RAY : CAMERA_RAY;
#ifdef TRANSPARENT
    come = load_chain().distance;
#endif
}
#endif
