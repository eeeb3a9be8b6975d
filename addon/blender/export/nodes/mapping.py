# SPDX-License-Identifier: GPL-3.0-or-later
"""Mapping, Vector Rotate, Vector Transform and Normal."""

from __future__ import annotations

import bpy
import numpy as np

from ..graph import Graph
from ..links import Scope
from ..programs import ZERO, Value, math
from .vectors import Numbers, unit, vector

# The numbers of glsl/nodes/rotate.glsl.
EULER, BACK, ABOUT = 0, 1, 2
AXES = {"X_AXIS": (1.0, 0.0, 0.0), "Y_AXIS": (0.0, 1.0, 0.0), "Z_AXIS": (0.0, 0.0, 1.0)}
# Those of glsl/nodes/space.glsl, to the object's space; 3 more are back.
WAYS = {"POINT": 0, "VECTOR": 1, "NORMAL": 2}


def read_mapping(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Mapping; what is constant becomes one transform at most."""
    at, turn, scale = (graph.input(node, x, scope) for x in ("Vector", "Rotation", "Scale"))
    kind = node.vector_type
    place = graph.input(node, "Location", scope) if kind in ("POINT", "TEXTURE") else ZERO
    if kind == "TEXTURE":
        return rotated(graph, at - place, turn, ZERO, BACK) / scale
    if kind == "NORMAL":
        return normalized(graph, rotated(graph, at / scale, turn, ZERO, EULER))
    if turn.is_just(0.0):
        return math("MULTIPLY_ADD", at, scale, place)
    if all(x.is_constant for x in (place, turn, scale)):
        linear = euler_matrix(turn.colour) * scale.colour
        return transformed(graph, at, np.column_stack((linear, place.colour)))
    return rotated(graph, at * scale, turn, ZERO, EULER) + place


def read_rotate(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Vector Rotate."""
    at, centre = (graph.input(node, name, scope) for name in ("Vector", "Center"))
    if node.rotation_type == "EULER_XYZ":
        turn, angle = graph.input(node, "Rotation", scope), ZERO
        way = BACK if node.invert else EULER
    else:
        axis = AXES.get(node.rotation_type)
        turn = graph.input(node, "Axis", scope) if axis is None else Value.of(axis)
        angle, way = graph.input(node, "Angle", scope), ABOUT
        angle = 0.0 - angle if node.invert else angle
    return rotated(graph, at - centre, turn, angle, way) + centre


def read_normal(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Normal: the direction that it holds, or its cosine with another."""
    direction = Value.of(unit(np.array(node.outputs[0].default_value[:], np.float64)))
    if output.name == "Normal":
        return direction
    other = normalized(graph, graph.value(node.inputs[0], scope))
    return vector(graph, "DOT_PRODUCT", direction, other, ZERO)


def read_transform(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Vector Transform: to world space, and from there."""
    at, way = graph.value(node.inputs[0], scope), WAYS[node.vector_type]
    given, wanted = node.convert_from, node.convert_to
    if given == wanted:
        return at
    if "CAMERA" in (given, wanted) and graph.context.camera is None:
        graph.notes.approximated(graph.owner, "Camera space", "world space is used")
    if given == "OBJECT":
        at = in_space(graph, at, way + 3)
    elif given == "CAMERA":
        at = _by_camera(graph, at, node.vector_type, is_back=True)
    if wanted == "OBJECT":
        return in_space(graph, at, way)
    return _by_camera(graph, at, node.vector_type, is_back=False) if wanted == "CAMERA" else at


def _by_camera(graph: Graph, at: Value, kind: str, is_back: bool) -> Value:
    """From world space to the camera's, which looks along its Z, or back."""
    if graph.context.camera is None:
        return at
    to_camera = graph.context.camera.to_camera
    rows = (np.linalg.inv(to_camera) if is_back else to_camera)[:3].copy()
    if kind != "POINT":
        rows[:, 3] = 0.0
    found = transformed(graph, at, rows)
    return normalized(graph, found) if kind == "NORMAL" else found


def in_space(graph: Graph, at: Value, way: int) -> Value:
    """A vector of world space in the object's, or one of that: glsl/nodes/space.glsl says which.
    The world's own is that."""
    if graph.volume == "world":
        return at
    return graph.program.emit("space", vector=at, way=Value.of(way))


def normalized(graph: Graph, at: Value) -> Value:
    """As long as 1; 0 stays."""
    return vector(graph, "NORMALIZE", at, ZERO, ZERO)


def transformed(graph: Graph, at: Value, rows: Numbers) -> Value:
    """By an affine transform (3, 4)."""

    def fold(at: Numbers, *rows: Numbers) -> list[float]:
        return [float(row[:3] @ at[:3] + row[3]) for row in rows]

    x, y, z = map(Value.of, rows)
    return graph.program.emit("matrix", fold, vector=at, x=x, y=y, z=z)


def rotated(graph: Graph, at: Value, turn: Value, angle: Value, way: int) -> Value:
    """Turned by Euler angles, back by these, or about an axis."""
    if turn.is_constant and angle.is_constant:
        if way == ABOUT:
            linear = axis_matrix(turn.colour, angle.number)
        else:
            linear = euler_matrix(turn.colour)
            linear = linear.T if way == BACK else linear
        if np.array_equal(linear, np.eye(3)):
            return at
        return transformed(graph, at, np.column_stack((linear, np.zeros(3))))
    slots = {"vector": at, "turn": turn, "angle": angle}
    return graph.program.emit("rotate", **slots, way=Value.of(way))


def euler_matrix(angles: Numbers) -> Numbers:
    """(3, 3), about X, then Y, then Z [rad]."""
    x, y, z = (axis_matrix(axis, angle) for axis, angle in zip(np.eye(3), angles, strict=True))
    found: Numbers = z @ y @ x
    return found


def axis_matrix(axis: Numbers, angle: float) -> Numbers:
    """(3, 3), about an axis of any length [rad]; about none nothing turns."""
    x, y, z = unit(axis)
    across = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    found: Numbers = np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
    return found
