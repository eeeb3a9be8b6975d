// SPDX-License-Identifier: GPL-3.0-or-later
// The energy of rough glass: fits to the integrals over a viewer's visible normals of what untinted GGX microfacets
// reflect and refract in one bounce. Roughness = sqrt(alpha) in [0, 1]; ior is that of the other side, relative.
// What is lost is roughness^2 times the output of a small network for each side.

// Of the network's neurons.
vec4 activation(vec4 x) { return x * inversesqrt(1.0 + x * x); }

float loss_from_outside(vec4 x) {
    vec4 a = activation(mat4(-1.587124, -0.04518594, -0.1714601, -0.1550685, -0.141233, -0.7369081, -0.430687, -2.020712, -1.252831, -1.012201, -0.4686667, 0.1522532, -5.034044, -0.8080593, 143.8953, -0.2173974) * x
        + vec4(-0.1433203, 2.403944, -8.218608, 2.281573));
    vec4 b = activation(mat4(0.001748744, 0.5177113, 20.08241, -25.99995, 1.386038, 0.275096, -0.4134239, 1.908108, 1.075938, 2.002736, 1.744545, -1.654216, 0.5890031, 2.054182, 0.781302, -19.25976) * x
        + vec4(-2.74414, -0.2194586, 0.5915191, -0.4245944));
    vec4 c = activation(mat4(-1.094995, 4.49716, 1.110479, 0.7194754, -1.022942, 1.816196, 0.1631076, -0.03063841, -0.1338712, 0.09758105, 0.4200796, 0.01982559, -2.316997, 2.442036, 1.918956, -2.251252) * a
        + mat4(-1.543182, 2.876145, 0.1991091, -0.3114661, -1.029906, 3.399906, 1.281313, 0.3664774, 2.879564, 0.2752495, -4.657903, 2.721577, 0.6237124, 0.3594525, -4.731674, 0.7483503) * b
        + vec4(-0.600067, -0.2583997, -1.861389, 0.4822223));
    vec4 d = activation(mat4(-2.159544, -1.821439, -2.281481, -3.713779, -0.7689236, -1.266288, -0.9630034, -0.7544152, -0.6930908, -0.4323105, -0.6824079, -0.191912, -2.506475, -3.285977, -2.5994, -2.992191) * a
        + mat4(-1.481156, -2.088794, -1.745177, -1.58466, -1.735702, -1.252582, -1.772028, -2.39575, 2.451543, 2.934339, 0.9198982, -1.924932, 3.006582, 1.92142, 0.8215689, -0.8142069) * b
        + vec4(1.69993, 0.9123852, 0.9488645, 1.914321));
    return dot(c, vec4(-38.00188, -18.70102, -13.80369, 18.69206))
        + dot(d, vec4(-44.06632, 13.19631, 37.79991, -15.38018)) + -4.375442;
}

float loss_from_inside(vec4 x, float edge) {
    vec4 a = activation(mat4(0.3547634, 0.01623757, -0.7146844, 0.6378842, -0.160151, 0.7227426, -1.441672, 0.6627117, -0.04691349, -0.7879717, -0.1364842, -0.5066934, 0.2025508, 3.024899, -0.6908338, -0.6418572) * x + vec4(-0.02452201, -1.025884, 0.02346808, -0.3912009) * edge
        + vec4(0.4226872, 0.5829102, 1.750687, -0.7562474));
    vec4 b = activation(mat4(1.556391, 0.3938608, 0.2485157, 1.707287, -0.9203571, -1.675056, 1.833841, 0.7958718, 1.234131, 0.9041248, 0.2821395, 0.3839991, 0.4555933, -4.246582, 0.4191387, -3.671341) * x + vec4(-0.1450259, 0.8401008, 0.05708756, 1.710851) * edge
        + vec4(-0.07115462, -0.3842529, -1.737119, 0.2936814));
    vec4 c = activation(mat4(0.1177285, -1.316742, -3.211794, 9.570326, 1.397817, 9.140439, 6.342, -9.664833, -4.725033, 10.72838, 3.649412, 2.155312, -0.2439893, -2.673754, -5.666789, 6.978484) * a
        + mat4(-1.522081, 1.987921, -4.232098, 7.511512, 0.6473602, 16.10934, 5.694993, -9.512796, -4.807663, 14.34047, -1.626395, 4.352413, -0.04545183, -0.2911658, -0.3828008, 1.589356) * b
        + vec4(-0.199145, 8.11304, -7.095266, 2.752005));
    vec4 d = activation(mat4(3.392704, 55.90941, 1.324997, 1.246266, -2.086085, -111.9277, -0.4088696, -0.4965778, -0.04363154, 15.19176, 2.261348, 0.6028249, -0.1455751, -0.4667439, 0.3084812, -0.1661116) * a
        + mat4(0.6140916, -0.582645, -0.4020772, -0.04710484, -2.164655, -36.88452, -0.2803992, -0.3555042, -2.696473, 15.55526, 2.309403, 0.5583936, 0.08935546, -1.564497, 0.167241, 0.1595351) * b
        + vec4(-1.031624, 48.5589, 0.4252013, -2.854835));
    return dot(c, vec4(1.766402, 3.285987, -14.474, -61.70897))
        + dot(d, vec4(1.892207, 31.79696, 2.854876, -26.71176)) + -13.62514;
}

// sqrt(|ior - 1| / (ior + 1)), for indices from 1/3 to 3.
float index_coordinate(float ior) {
    float n = clamp(max(ior, 1.0 / ior), 1.0, 3.0);
    return sqrt((n - 1.0) / (n + 1.0));
}

// Albedo at this cosine, 0.075 and more: relative error 0.5 % outside, 1.6 % inside; in the mean of all 0.07 and 0.2 %.
float single_albedo_glass(float cosine, float roughness, float ior) {
    float y = max(1.0e-7, roughness * roughness), z = index_coordinate(ior), c = max(cosine, 0.02);
    vec4 x = vec4(c, c / (c + 0.7 * y), roughness, z);
    float loss;
    if (ior >= 1.0) {
        loss = loss_from_outside(x);
    } else {
        float n = (1.0 + z * z) / (1.0 - z * z), beyond = c - sqrt(1.0 - 1.0 / (n * n));
        loss = loss_from_inside(x, beyond * inversesqrt(beyond * beyond + y * y + 0.001));
    }
    return clamp(1.0 - y * loss, 0.05, 1.0);
}

float mean_loss_from_outside(float roughness, float z) {
    float sum = 0.0;
    sum = sum * roughness + 0.1196402 + z * (7.287063 + z * (-38.56012 + z * (55.77486 + z * (-23.9214))));
    sum = sum * roughness + -0.09329016 + z * (-21.20058 + z * (100.8593 + z * (-136.3192 + z * (52.67863))));
    sum = sum * roughness + -0.4574221 + z * (21.51991 + z * (-86.87743 + z * (103.3742 + z * (-31.79111))));
    sum = sum * roughness + 0.6543748 + z * (-8.321886 + z * (25.28392 + z * (-20.18827 + z * (0.2213257))));
    sum = sum * roughness + -0.05670141 + z * (0.6868326 + z * (-0.6416805 + z * (-2.230343 + z * (2.730381))));
    return sum;
}

float mean_loss_from_inside(float roughness, float z) {
    float sum = 0.0;
    sum = sum * roughness + 0.5514299 + z * (-39.69981 + z * (218.1941 + z * (-363.6689 + z * (193.6798))));
    sum = sum * roughness + -1.46306 + z * (111.1606 + z * (-550.7302 + z * (841.6032 + z * (-411.7427))));
    sum = sum * roughness + 1.08354 + z * (-106.1364 + z * (438.5475 + z * (-558.7165 + z * (216.4815))));
    sum = sum * roughness + -0.04357794 + z * (36.83524 + z * (-99.46782 + z * (52.59779 + z * (24.58743))));
    sum = sum * roughness + 0.03932299 + z * (-2.336008 + z * (-1.065614 + z * (18.56392 + z * (-18.14341))));
    return sum;
}

// Its mean over the hemisphere, weighted by the cosine. Error 0.003.
float single_albedo_average_glass(float roughness, float ior) {
    float z = index_coordinate(ior);
    float loss = ior >= 1.0 ? mean_loss_from_outside(roughness, z) : mean_loss_from_inside(roughness, z);
    return clamp(1.0 - roughness * roughness * loss, 0.05, 1.0);
}
