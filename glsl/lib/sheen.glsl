// SPDX-License-Identifier: GPL-3.0-or-later
// Sheen of a layer of fibres, all of its bounces (Zeltner, Burley & Chiang 2022, "Practical Multiple-Scattering Sheen
// Using Linearly Transformed Cosines"): fits to the published values, of total degree 7.
#include "lib/sampling.glsl"

// What a white layer reflects to a viewer at this cosine, and the transform to the cosine that its lobe is: the entries
// a (of x and y) and b (of z in x) of the inverse. Error of the albedo: 0.005 for a roughness of 0.2 and more; of the
// lobe, in the mean of its absolute value: 0.005 of it, where it is brighter than 0.02 at worst 0.04.
struct Sheen { float albedo; float a; float b; };

Sheen sheen_of(float cosine, float roughness) {
    float r = clamp(roughness, 0.04, 1.0), x = cosine / (cosine + r), y = 0.2 / (r + 0.2);
    vec3 row, sum;
    row = vec3(-68.668739, 11.05791, 71.505196);
    sum = row;
    row = vec3(1071.9658, -176.16037, -41.667141);
    row = row * y + vec3(-244.5103, 60.872131, -154.91319);
    sum = sum * x + row;
    row = vec3(-1089.9338, 113.019, 246.06306);
    row = row * y + vec3(-990.92212, 226.59985, -182.56189);
    row = row * y + vec3(389.53458, -111.39084, 188.8625);
    sum = sum * x + row;
    row = vec3(-193.08418, -625.83148, -22.511116);
    row = row * y + vec3(1899.425, 514.06641, -379.03372);
    row = row * y + vec3(-259.79675, -260.17932, 356.68607);
    row = row * y + vec3(-130.40207, 76.433685, -141.4735);
    sum = sum * x + row;
    row = vec3(1638.1694, -1015.5743, 492.27902);
    row = row * y + vec3(-2820.0691, 2740.2573, -1079.4667);
    row = row * y + vec3(888.06268, -2029.9633, 1085.123);
    row = row * y + vec3(-105.81075, 538.80432, -498.65662);
    row = row * y + vec3(34.25222, -54.53511, 88.248726);
    sum = sum * x + row;
    row = vec3(-1752.1979, 428.94672, 136.98361);
    row = row * y + vec3(3090.0452, -70.366005, -900.88434);
    row = row * y + vec3(-1862.3303, -1198.0662, 1533.2841);
    row = row * y + vec3(584.57629, 1113.1677, -1122.1715);
    row = row * y + vec3(-110.23838, -314.35654, 369.17618);
    row = row * y + vec3(4.3184037, 25.47275, -42.907364);
    sum = sum * x + row;
    row = vec3(726.3244, -1945.6165, -372.26105);
    row = row * y + vec3(-1214.1294, 5137.2212, 1067.1249);
    row = row * y + vec3(551.31317, -5464.248, -1034.988);
    row = row * y + vec3(49.414639, 3097.7783, 324.70743);
    row = row * y + vec3(-94.071495, -1036.4583, 59.66185);
    row = row * y + vec3(20.68351, 196.0723, -48.118755);
    row = row * y + vec3(-1.9374131, -13.5169, 6.1715345);
    sum = sum * x + row;
    row = vec3(-231.44847, 2151.5991, -51.718628);
    row = row * y + vec3(662.08258, -6927.8413, 421.15271);
    row = row * y + vec3(-887.05817, 9314.3086, -1031.1721);
    row = row * y + vec3(722.81488, -6788.3276, 1183.7159);
    row = row * y + vec3(-380.25916, 2884.0449, -726.78473);
    row = row * y + vec3(123.90534, -697.68402, 245.72794);
    row = row * y + vec3(-22.174286, 77.652611, -43.264587);
    row = row * y + vec3(1.2715105, -3.048455, 2.938792);
    sum = sum * x + row;
    return Sheen(min(exp(sum.x), 1.0), clamp(exp(sum.y), 0.01, 1.0), clamp(sum.z, -0.3, 0.1));
}

// Its x axis is the viewer's side.
mat3 sheen_frame(vec3 normal, vec3 to_viewer) {
    vec3 across = cross(normal, to_viewer);
    float l2 = dot(across, across);
    if (l2 < 1.0e-12) return frame_about(normal);
    across *= inversesqrt(l2);
    return mat3(cross(across, normal), across, normal);
}

// Density [1/sr] over the cosine: the lobe is this times the albedo.
float sheen_density(Sheen s, vec3 to_light) {
    float x = s.a * to_light.x + s.b * to_light.z, y = s.a * to_light.y;
    float q = s.a / (x * x + y * y + to_light.z * to_light.z);
    return q * q / PI;
}
