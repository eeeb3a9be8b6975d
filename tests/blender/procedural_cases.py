# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures, and colours of light, on sheets."""

from __future__ import annotations

from typing import Any

import bpy

from .node_cases import VECTOR, Build, Case, U, V, node, scaled

DIMENSIONS = ("1D", "2D", "3D", "4D")
NOISES = ("FBM", "MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HETERO_TERRAIN")
FEATURES = ("F1", "F2", "SMOOTH_F1")
METRICS = ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI")
GRADIENTS = (
    *("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "RADIAL"),
    *("QUADRATIC_SPHERE", "SPHERICAL"),
)
W = scaled(V, -1.37, 1.61)
STEPS = node("ShaderNodeMath", {0: scaled(U, -3.1, 4.9)}, operation="FLOOR")
OCTAVES = {"Scale": 1.3, "Detail": 1.6, "Roughness": 0.6, "Lacunarity": 2.1}
RED, BLUE, GREY = (0.9, 0.2, 0.1, 1.0), (0.1, 0.3, 0.8, 1.0), (0.3, 0.25, 0.2, 1.0)


def texture(
    kind: str, output: str, inputs: Any, limits: tuple[float, float] = (0.0, 1.0), **options: Any
) -> Case:
    """An output of ShaderNodeTex`kind`, with what `limits` it may have."""
    build = node(f"ShaderNodeTex{kind}", inputs, output, **options)
    return Case(f"{kind}: {'/'.join(map(str, [output, *options.values()]))}", build, *limits)


def place(dimensions: str, vector: Build = VECTOR, w: Build = W) -> dict[str, Build]:
    return (
        {}
        | ({"Vector": vector} if dimensions != "1D" else {})
        | ({"W": w} if dimensions in ("1D", "4D") else {})
    )


def noise(d: str, kind: str, output: str = "Fac", normalize: bool = True, **more: Any) -> Case:
    limits = (0.0, 1.0) if normalize and kind == "FBM" else (-1.5, 2.5)
    inputs = place(d) | OCTAVES | {"Offset": 0.6, "Gain": 1.3} | more
    options = {"noise_dimensions": d, "noise_type": kind, "normalize": normalize}
    return texture("Noise", output, inputs, limits, **options)


def noises() -> list[Case]:
    """All types in all dimensions; the colour, distorted, and as it is, in all dimensions."""
    found = [noise("3D", "FBM", "Color")]
    found += [noise(d, kind, normalize=False) for d in DIMENSIONS for kind in NOISES]
    found += [noise(d, "FBM", "Color") for d in DIMENSIONS if d != "3D"]
    return found + [noise(d, "FBM", Distortion=0.6, Detail=1.0) for d in DIMENSIONS]


def voronoi(
    d: str, feature: str, output: str, metric: str = "EUCLIDEAN", normalize: bool = True
) -> Case:
    inputs: dict[str, Any] = place(d) | OCTAVES | {"Randomness": 0.8, "Smoothness": 0.7}
    inputs["Exponent"] = 1.7
    limits = (0.0, 1.0 if normalize else 5.0)
    if output in ("Position", "W"):
        inputs["Detail"], limits = 0.0, (-3.0, 3.0)
    if feature == "N_SPHERE_RADIUS":
        inputs["Scale"] = 3.0
    options = {"voronoi_dimensions": d, "feature": feature, "distance": metric}
    return texture("Voronoi", output, inputs, limits, **options, normalize=normalize)


def points() -> list[Case]:
    """F1, F2 and Smooth F1 in all dimensions, by all metrics; each output, in all dimensions."""
    found = [voronoi("3D", "F1", "Distance", normalize=False)]
    for feature in FEATURES:
        for number, d in enumerate(DIMENSIONS):
            metric = METRICS[max(number - 1, 0)]
            found.append(voronoi(d, feature, "Distance", metric))
            found.append(voronoi(d, feature, "Color"))
            found.append(voronoi(d, feature, "W" if d == "1D" else "Position"))
        found.append(voronoi("4D", feature, "W"))
        found.append(voronoi("3D", feature, "Distance", "MINKOWSKI"))
        found.append(voronoi("2D", feature, "Position", "MINKOWSKI"))
    return found


def metrics() -> list[Case]:
    """Every output in all dimensions by all metrics, and both ways to normalize."""
    return [
        voronoi(d, feature, output, metric, normalize)
        for feature in FEATURES
        for d in DIMENSIONS[1:]
        for metric in METRICS
        for output in ("Distance", "Color", "Position")
        for normalize in (False, True)
    ]


def edges() -> list[Case]:
    """Distance to Edge and N-Sphere Radius."""
    found = []
    for d in DIMENSIONS:
        for normalize in (False, True):
            found.append(voronoi(d, "DISTANCE_TO_EDGE", "Distance", normalize=normalize))
        found.append(voronoi(d, "N_SPHERE_RADIUS", "Radius"))
    return found


def waves() -> list[Case]:
    """All directions and profiles, distorted and not."""
    common = {"Vector": VECTOR, "Scale": 0.3, "Phase Offset": 0.7, "Detail": 1.4}
    common |= {"Detail Roughness": 0.6, "Detail Scale": 1.3}
    found = []
    for kind, directions in (
        ("BANDS", ("X", "Y", "Z", "DIAGONAL")),
        ("RINGS", ("X", "Y", "Z", "SPHERICAL")),
    ):
        for direction in directions:
            options = {"wave_type": kind, f"{kind.lower()}_direction": direction}
            found.append(texture("Wave", "Fac", common, **options))
    for profile in ("SIN", "SAW", "TRI"):
        found.append(texture("Wave", "Color", common | {"Distortion": 1.5}, wave_profile=profile))
    return found


def patterns() -> list[Case]:
    """Gradient, Checker, Brick, Magic."""
    found = [
        texture("Gradient", "Fac", {"Vector": VECTOR}, (-0.2, 1.2), gradient_type=kind)
        for kind in GRADIENTS
    ]
    found.append(Case("Gradient: generated", node("ShaderNodeTexGradient")))
    colours = {"Color1": RED, "Color2": BLUE}
    for output in ("Color", "Fac"):
        checked = {"Vector": VECTOR, "Scale": 2.3} | colours
        found.append(texture("Checker", output, checked, (-1.0, 2.0)))
    bricks = {"Vector": VECTOR, "Scale": 1.0, "Mortar Size": 0.1, "Bias": -0.1, "Mortar": GREY}
    bricks |= {"Brick Width": 0.9, "Row Height": 0.6} | colours
    rows = {"offset": 0.3, "offset_frequency": 3, "squash": 1.6, "squash_frequency": 2}
    for output, smooth in (("Color", 0.0), ("Color", 0.9), ("Fac", 0.9)):
        inputs = bricks | {"Mortar Smooth": smooth}
        found.append(texture("Brick", output, inputs, (-1.0, 2.0), **rows))
    if bpy.app.version < (5, 2):  # by what a compiler makes of infinity, and so another since
        flat = bricks | {"Brick Width": 0.0, "Mortar Smooth": 0.1}
        found.append(Case("Brick: flat", texture("Brick", "Color", flat, (-1.0, 2.0)).build))
    for depth in range(11):
        inputs = {"Vector": VECTOR, "Scale": 0.25, "Distortion": 1.2}
        found.append(texture("Magic", "Color", inputs, turbulence_depth=depth))
    return [*found, texture("Magic", "Fac", {"Vector": VECTOR, "Scale": 0.4})]


def randoms() -> list[Case]:
    """White Noise of whole numbers; Gabor."""
    found = [
        texture("WhiteNoise", output, place(d, STEPS, STEPS), noise_dimensions=d)
        for d in DIMENSIONS
        for output in ("Value", "Color")
    ]
    common = {"Vector": VECTOR, "Scale": 0.9, "Frequency": 1.5}
    for kind in ("2D", "3D"):
        for output in ("Value", "Phase", "Intensity"):
            inputs = common | {"Anisotropy": 0.6}
            found.append(texture("Gabor", output, inputs, gabor_type=kind))
        alike = texture("Gabor", "Value", common | {"Anisotropy": 1.0}, gabor_type=kind)
        found.append(Case(f"Gabor: anisotropic/{kind}", alike.build))
    return found


def lights() -> list[Case]:
    """Blackbody, and Wavelength."""
    found = []
    for low, high in ((700.0, 2500.0), (2500.0, 13000.0)):
        inputs = {"Temperature": scaled(U, low, high)}
        build = node("ShaderNodeBlackbody", inputs)
        found.append(Case(f"Blackbody: {low:g}", build, 0.0, 6.0 if low < 2500.0 else 2.2))
    build = node("ShaderNodeWavelength", {"Wavelength": scaled(U, 370.0, 790.0)})
    return [*found, Case("Wavelength", build)]


def extremes() -> list[Case]:
    """What sliders, or what is linked to inputs, may give; no more is asked than a number."""
    far = node("ShaderNodeVectorMath", {0: VECTOR, 1: (1e12, 3e19, -1e9)}, operation="MULTIPLY")
    layers: list[dict[str, Any]] = [
        {"Vector": far, "W": 1e30},
        {"Vector": VECTOR, "Scale": 0.0, "Detail": 15.0, "Roughness": 1.0},
        {"Vector": VECTOR, "Detail": 3.0, "Lacunarity": 0.0},
        {"Vector": VECTOR, "Detail": 15.0, "Lacunarity": 1000.0, "Roughness": 0.0},
    ]
    found = [
        Case(f"Noise {d}/{number}", node("ShaderNodeTexNoise", own, "Color", **options))
        for d in DIMENSIONS[::3]
        for number, own in enumerate(layers)
        for options in ({"noise_dimensions": d, "noise_type": "HYBRID_MULTIFRACTAL"},)
    ]
    for feature, metric in zip((*FEATURES, "DISTANCE_TO_EDGE"), METRICS[::-1], strict=True):
        for number, own in enumerate([*layers, {"Exponent": 0.0, "Randomness": 0.0}]):
            options = {"feature": feature, "distance": metric, "normalize": True}
            output = ("Distance", "Position")[number % 2]
            build = node("ShaderNodeTexVoronoi", own, output, **options)
            found.append(Case(f"Voronoi {feature}/{number}", build))
    for kind, own in (
        ("Wave", {"Vector": far, "Distortion": 1e20}),
        ("Gradient", {"Vector": far}),
        ("Checker", {"Vector": far}),
        ("Brick", {"Vector": far}),
        ("Brick", {"Vector": VECTOR, "Brick Width": 0.0, "Row Height": 0.0, "Mortar Size": 0.0}),
        ("Magic", {"Vector": far, "Distortion": 0.0}),
        ("WhiteNoise", {"Vector": far}),
        ("Gabor", {"Vector": far, "Frequency": 1e20}),
    ):
        found.append(Case(f"{kind} far", node(f"ShaderNodeTex{kind}", own)))
    nowhere = {"Orientation 3D": (0.0, 0.0, 0.0), "Vector": VECTOR}
    return [*found, Case("Gabor nowhere", node("ShaderNodeTexGabor", nowhere, gabor_type="3D"))]


CASES = {
    "noise": noises(),
    "voronoi": points(),
    "edges": edges(),
    "waves": waves(),
    "patterns": patterns(),
    "random": randoms(),
    "lights": lights(),
}
LONG_CASES = {"metrics": metrics()}
