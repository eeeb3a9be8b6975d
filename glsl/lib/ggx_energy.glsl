// SPDX-License-Identifier: GPL-3.0-or-later
// The energy of GGX reflection: fits to the integrals over a viewer's visible normals (Heitz 2018).
// Isotropic; roughness = sqrt(alpha) in [0, 1].

// Albedo at this cosine of one bounce between white microfacets. Relative error 0.0015 for a cosine
// of 0.05 and more.
float single_albedo_ggx(float cosine, float roughness) {
    float y = max(1.0e-7, roughness * roughness);
    float x = cosine / (cosine + 0.7 * y);
    float top = 0.35441024;
    top = top * x + (-0.52355407 + y * 0.39049263);
    top = top * x + (-0.0037345038 + y * (-0.52507655 - y * 0.72712613));
    top = top * x + (0.18388677 + y * (0.15375784 + y * (0.58690119 + y * 0.17821853)));
    top = top * x + (-0.010806083 + y * (0.0020812995 + y * (0.17970205 + y * (-0.29362704 + y * 0.13359658))));
    float bottom = 1.2599589;
    bottom = bottom * x + (-0.99003128 - y * 1.3182664);
    bottom = bottom * x + (-1.0450967 + y * (1.9575928 - y * 0.22818458));
    bottom = bottom * x + (1.0 + y * (-0.77486452 + y * (0.058996574 + y * 0.20223559)));
    return 1.0 - clamp(top / bottom, 0.0, 0.95);
}

// Its mean over the hemisphere, weighted by the cosine: 2 cosine d cosine. Relative error 0.0001.
float single_albedo_average_ggx(float r) {
    return 1.0 - r * r * (0.00090042102 + r * (0.26827315 + r * (3.2532369 + r * (-4.7678846 + r * (1.9563903 - r * 0.12001356)))));
}

// The cosine at which a smooth dielectric has the mean of (F - F0) / (1 - F0) that this rough one has over
// its visible normals. Error of that mean: 0.0023 for ior 1.1 to 3 and a cosine of 0.05 and more.
float smooth_cosine_ggx(float cosine, float roughness, float ior) {
    float n = clamp(max(ior, 1.0 / ior), 1.0, 3.0);
    float z2 = (n - 1.0) / (n + 1.0), z = sqrt(z2), y = roughness;
    float along = cosine + 1.4 * max(1.0e-7, roughness * roughness);
    float x = cosine / along;
    vec3 p = vec3(6.1348214, -40.989841, 42.636381);
    p = p * x
        + (vec3(-17.957743, 130.22966, -134.41643)
              + y * (vec3(12.738614, -104.47133, 107.13897)));
    p = p * x
        + (vec3(20.49743, -151.74465, 154.40564)
              + y * (vec3(-26.612543, 221.85074, -221.44713)
              + y * (vec3(2.5261829, -53.261713, 48.343735))));
    p = p * x
        + (vec3(-10.545716, 84.931625, -85.037366)
              + y * (vec3(24.086961, -180.83188, 175.77515)
              + y * (vec3(-14.938858, 99.213686, -85.953297)
              + y * (vec3(4.1949407, -14.061454, 5.9292968)))));
    p = p * x
        + (vec3(1.8073414, -32.47783, 33.283511)
              + y * (vec3(-8.0874997, 111.75766, -115.70118)
              + y * (vec3(19.37399, -186.67828, 196.35094)
              + y * (vec3(-25.198401, 182.40185, -194.69085)
              + y * (vec3(12.522847, -76.83025, 82.794598))))));
    p = p * x
        + (vec3(1.0624622, 10.090187, -10.90679)
              + y * (vec3(-1.9833093, -50.927867, 56.698227)
              + y * (vec3(-1.0042273, 147.28783, -165.25304)
              + y * (vec3(7.2781521, -232.58456, 262.44)
              + y * (vec3(-7.5550761, 180.97125, -205.64322)
              + y * (vec3(2.3583578, -54.085298, 61.963753)))))));
    return clamp(along * dot(p, vec3(1.0, z, z2)), 0.0, 1.0);
}
