// SPDX-License-Identifier: GPL-3.0-or-later
//! How the elements of those streams and tables are laid out that the native core reads or writes, as
//! addon/photon/kernels/records.py declares them: whoever imports the core compares the two.

/// Records by name, and their fields in order.
pub const LAYOUTS: [(&str, &str); 26] = [
    ("RayOrigin", "vec3 position; float source"),
    ("RayDirection", "vec3 direction; float t_max"),
    ("Hit", "float t; float triangle; float u; float v"),
    ("Place", "vec3 position; float surface"),
    ("Facing", "vec3 normal; float side"),
    ("Shading", "vec3 normal; float triangle"),
    ("Diffuse", "vec3 albedo; float flags"),
    ("Cuts", "vec2 first; vec2 second"),
    ("Coverage", "float share; float inner; float scale; float inner_scale"),
    ("Tilt", "vec2 outer; vec2 inner"),
    ("Deposit", "vec3 flux; float normal"),
    ("Triangle", "vec3 a; float material; vec3 b; float surface; vec3 c; float number"),
    (
        "RadiusGrid",
        "vec3 origin; float first; vec3 cells; float cell_size; vec3 low; float first_corner; vec3 high",
    ),
    ("CornerNormals", "vec3 a; float terminator; vec3 b; vec3 c; float flags"),
    ("LightAim", "vec3 middle; float root"),
    ("AimNode", "float axis; float share; float first"),
    ("Portal", "vec3 middle; float width; vec3 across; float height; vec3 axis"),
    ("PlainMaterial", "vec3 diffuse; float exponent; vec3 specular; float gathers"),
    ("Gathered", "vec3 normal; float albedo"),
    ("PlainLobe", "vec3 mirrored; float exponent"),
    ("PlainPeak", "vec3 peak"),
    ("Scaled", "vec3 scale; float alpha"),
    ("Based", "vec3 f0; float ior"),
    ("Base", "vec3 normal; float is_bent"),
    ("Dipped", "vec3 dip; float shape"),
    (
        "PlainLight",
        "vec3 position; float radius; vec3 axis; float outer; vec3 power; float inner; float chosen; float cdf",
    ),
];
