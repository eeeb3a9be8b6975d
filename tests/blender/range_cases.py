# SPDX-License-Identifier: GPL-3.0-or-later
"""Map Range, Clamp, Color Ramp and curves on a sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import bpy

from .node_cases import COLOUR, VECTOR, Build, Case, U, V, node, scaled, three

RANGE, CLAMP, RAMP = "ShaderNodeMapRange", "ShaderNodeClamp", "ShaderNodeValToRGB"
# From 0 to 0.5, twice.
HALF = node("ShaderNodeMath", {0: U, 1: 0.5}, operation="FLOORED_MODULO")
BEYOND = scaled(U, -0.5, 1.5)
Points = Sequence[Sequence[tuple[float, float]]]  # of each curve
STOPS = ((0.1, (0.9, 0.1, 0.2, 0.3)), (0.45, (0.1, 0.8, 0.3, 0.9)), (0.8, (0.2, 0.1, 0.9, 0.6)))


def _ranges(kind: str) -> tuple[Case, ...]:
    of_vectors = {
        "Vector": VECTOR,
        "From_Min_FLOAT3": (-1.0, 0.0, 0.8),
        "From_Max_FLOAT3": (1.0, 1.0, -0.8),
        "To_Min_FLOAT3": (0.1, 0.9, 0.2),
        "To_Max_FLOAT3": (0.9, 0.2, 0.8),
        "Steps_FLOAT3": (3.0, 4.0, 0.0),
    }
    given = {0: BEYOND, 1: 0.1, 2: 0.87, 3: 0.2, 4: 0.9, 5: 3.0}
    turned, varying = {**given, 1: 0.87, 2: 0.1}, {**given, 1: scaled(V, 0.0, 0.4), 4: V}
    options = {"interpolation_type": kind}
    return (
        Case(f"Map Range: {kind}", node(RANGE, given, clamp=False, **options), -0.5, 1.5),
        Case(f"Map Range: {kind} clamped", node(RANGE, varying, clamp=True, **options)),
        Case(f"Map Range: {kind} turned", node(RANGE, turned, clamp=True, **options)),
        Case(
            f"Map Range: {kind} vectors",
            node(RANGE, of_vectors, "Vector", data_type="FLOAT_VECTOR", clamp=True, **options),
        ),
        Case(
            f"Map Range: {kind} free",
            node(RANGE, of_vectors, "Vector", data_type="FLOAT_VECTOR", clamp=False, **options),
            -0.5,
            1.5,
        ),
    )


def ramp(
    mode: str, interpolation: str, hue: str = "NEAR", output: str = "Color", at: Any = BEYOND
) -> Build:
    """A Color Ramp of STOPS."""

    def build(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        socket = node(RAMP, {0: at}, output)(tree)
        found = socket.node.color_ramp
        found.color_mode, found.interpolation, found.hue_interpolation = mode, interpolation, hue
        found.elements.new(0.5)
        for element, (position, colour) in zip(found.elements, STOPS, strict=True):
            element.position, element.color = position, colour
        return socket

    return build


def curve(kind: str, inputs: Mapping[int, Any], points: Points, extend: str) -> Build:
    """A node of curves that go through these points, too."""

    def build(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        socket = node(kind, inputs)(tree)
        mapping = socket.node.mapping
        for one, places in zip(mapping.curves, points, strict=False):
            for place in places:
                one.points.new(*place)
        mapping.extend = extend
        mapping.update()
        return socket

    return build


BENT = ([(0.3, 0.6)], [(0.5, 0.2)], [(0.2, 0.1), (0.7, 0.9)], [(0.4, 0.5)])
NUMBER = [(-0.2, 0.1), (0.6, 0.9)]
RGB_CURVES, VECTOR_CURVES = "ShaderNodeRGBCurve", "ShaderNodeVectorCurve"
STRONG = three(BEYOND, scaled(V, -0.5, 1.5), U)
CASES = (
    *(
        case
        for kind in ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP")
        for case in _ranges(kind)
    ),
    Case(
        "Map Range: empty",
        node(
            RANGE,
            {
                0: V,
                1: node("ShaderNodeMath", {0: U, 1: 0.5}, operation="FLOORED_MODULO"),
                2: 0.25,
                3: 0.6,
            },
        ),
        -2.0,
        2.0,
    ),
    Case("Clamp: MINMAX", node(CLAMP, {0: BEYOND, 1: 0.2, 2: V})),
    Case("Clamp: RANGE", node(CLAMP, {0: BEYOND, 1: 0.6, 2: V}, clamp_type="RANGE")),
    *(
        Case(f"Color Ramp: {kind}", ramp("RGB", kind))
        for kind in ("LINEAR", "EASE", "CARDINAL", "B_SPLINE", "CONSTANT")
    ),
    *(
        Case(f"Color Ramp: {mode} {hue}", ramp(mode, "LINEAR", hue))
        for mode in ("HSV", "HSL")
        for hue in ("NEAR", "FAR", "CW", "CCW")
    ),
    *(
        Case(
            f"Color Ramp: constant on a stop/{output}",
            ramp("RGB", "CONSTANT", at=0.45, output=output),
        )
        for output in ("Color", "Alpha")
        if bpy.app.version >= (5, 0)
    ),
    # Where a table of another length would step elsewhere.
    Case("Color Ramp: where it steps", ramp("RGB", "CONSTANT", at=scaled(U, 0.44, 0.46))),
    Case("Color Ramp: alpha", ramp("RGB", "LINEAR", output="Alpha")),
    *(
        Case(f"RGB Curves: {x}", curve(RGB_CURVES, {0: V, 1: STRONG}, BENT, x), -0.5, 1.5)
        for x in ("HORIZONTAL", "EXTRAPOLATED")
    ),
    Case("RGB Curves: whole", curve(RGB_CURVES, {0: 1.0, 1: COLOUR}, BENT, "HORIZONTAL")),
    *(
        Case(f"Vector Curves: {x}", curve(VECTOR_CURVES, {0: 1.0, 1: VECTOR}, BENT, x), -2.0, 2.0)
        for x in ("HORIZONTAL", "EXTRAPOLATED")
    ),
    *(
        Case(
            f"Float Curve: {x}",
            curve("ShaderNodeFloatCurve", {0: 0.8, 1: scaled(U, -1.0, 2.0)}, [NUMBER], x),
            -1.0,
            2.0,
        )
        for x in ("HORIZONTAL", "EXTRAPOLATED")
    ),
)
