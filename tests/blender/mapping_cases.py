# SPDX-License-Identifier: GPL-3.0-or-later
"""Mapping, Vector Rotate, Vector Transform, Normal on a sheet."""

from __future__ import annotations

from typing import Any

import bpy

from .node_cases import COLOUR, VECTOR, Build, Case, U, V, node, scaled, three, turned

MAPPING, ROTATE, TRANSFORM = (
    f"ShaderNode{x}" for x in ("Mapping", "VectorRotate", "VectorTransform")
)
PLACE, TURN, SCALE = (0.3, -0.2, 0.5), (0.4, -0.7, 1.1), (0.8, 1.3, -0.6)
TURNING = three(U, 0.4, scaled(V, -2.0, 2.0))


def _mapping(kind: str) -> tuple[Case, ...]:
    constant: dict[str, Any] = {"Vector": VECTOR, "Rotation": TURN, "Scale": SCALE}
    varying = {**constant, "Rotation": TURNING}
    if kind in ("POINT", "TEXTURE"):
        constant["Location"] = PLACE
        varying["Location"] = COLOUR
    plain = {**constant, "Rotation": (0.0, 0.0, 0.0)}
    ends = (-4.0, 4.0)
    return (
        Case(f"Mapping: {kind}", node(MAPPING, constant, vector_type=kind), *ends),
        Case(f"Mapping: {kind} varying", node(MAPPING, varying, vector_type=kind), *ends),
        Case(f"Mapping: {kind} straight", node(MAPPING, plain, vector_type=kind), *ends),
    )


def _rotate(kind: str, invert: bool) -> tuple[Case, ...]:
    given = {"Vector": VECTOR, "Center": PLACE, "Axis": (0.3, -0.5, 0.8)}
    turn = {"Rotation": TURN} if kind == "EULER_XYZ" else {"Angle": 0.8}
    turning = {"Rotation": TURNING} if kind == "EULER_XYZ" else {"Angle": scaled(U, -3.0, 3.0)}
    options = {"rotation_type": kind, "invert": invert}
    name = f"Vector Rotate: {kind}{' back' if invert else ''}"
    return (
        Case(name, node(ROTATE, given | turn, **options), -3.0, 3.0),
        Case(f"{name} varying", node(ROTATE, given | turning, **options), -3.0, 3.0),
    )


def _transform(kind: str, given: str, wanted: str) -> Case:
    options = {"vector_type": kind, "convert_from": given, "convert_to": wanted}
    ends = (-12.0, 12.0) if kind == "POINT" else (-3.0, 3.0)
    built = node(TRANSFORM, {0: VECTOR}, **options)
    return Case(f"Vector Transform: {kind} {given}-{wanted}", built, *ends, dress=turned)


def direction(output: str) -> Build:
    """A Normal node that points somewhere."""

    def build(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        socket = node("ShaderNodeNormal", {0: VECTOR}, output)(tree)
        socket.node.outputs[0].default_value = (0.4, -0.3, 0.8)
        return socket

    return build


SPACES = ("WORLD", "OBJECT", "CAMERA")
CASES = (
    *(case for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL") for case in _mapping(kind)),
    *(
        case
        for kind in ("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ")
        for invert in (False, True)
        for case in _rotate(kind, invert)
    ),
    *(
        _transform(kind, given, wanted)
        for kind in ("POINT", "VECTOR", "NORMAL")
        for given in SPACES
        for wanted in SPACES
        if given != wanted
    ),
    Case("Normal: dot", direction("Dot"), -1.0, 1.0),
)
