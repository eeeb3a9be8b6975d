// SPDX-License-Identifier: GPL-3.0-or-later
// Mist, as Cycles' pass has it, which hides nothing in the picture. `mist`: how near it begins, one over the distance
// in which it grows thick [scene units]; to which power it does; whether distances are along the view. Uses the uniforms
// `eye` and `view_axis`, too.

// What mist leaves to see of a place.
float nearness_of(vec3 place) {
    float away = mist.w > 0.0 ? abs(dot(place - eye, view_axis)) : distance(place, eye);
    return 1.0 - pow(clamp((away - mist.x) * mist.y, 0.0, 1.0), mist.z);
}
