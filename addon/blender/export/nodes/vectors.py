# SPDX-License-Identifier: GPL-3.0-or-later
"""Vector Math, Separate and Combine XYZ."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..arithmetic import ARITHMETIC, FUNCTIONS
from ..graph import Graph
from ..links import Scope
from ..programs import ONE, Value, math

Numbers = NDArray[np.float64]
# Vector Math's names of what each coordinate has by itself, where Math has another.
NAMES = {"FRACTION": "FRACT"}
ONE_INPUT = {"ABSOLUTE", "SIGN", "ROUND", "FLOOR", "CEIL", "FRACTION", "SINE", "COSINE", "TANGENT"}
THREE_INPUTS = {"MULTIPLY_ADD", "WRAP"}


def read_math(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Vector Math; an operation that nobody knows gives 0, and is noted."""
    operation = node.operation
    a, b, c, scale = (lambda i=i: graph.value(node.inputs[i], scope) for i in range(4))
    if operation in VECTOR:
        third = scale() if operation == "REFRACT" else c()
        return vector(graph, operation, a(), b(), third)
    if operation == "SCALE":
        return math("MULTIPLY", a(), scale())
    name = NAMES.get(operation, operation)
    if name not in ARITHMETIC and name not in FUNCTIONS:
        graph.notes.approximated(graph.owner, f"Vector Math {operation}", "0 is used")
        return Value.of(0.0)
    count = 1 if operation in ONE_INPUT else 3 if operation in THREE_INPUTS else 2
    return math(name, *(read() for read in (a, b, c)[:count]))


def vector(graph: Graph, operation: str, a: Value, b: Value, c: Value) -> Value:
    """One of VECTOR's operations."""
    number, function = VECTOR[operation]

    def fold(a: Numbers, b: Numbers, c: Numbers, _: Numbers) -> Any:
        return function(a[:3], b[:3], c[:3])

    return graph.program.emit("vector", fold, a=a, b=b, c=c, operation=Value.of(number))


def combined(graph: Graph, x: Value, y: Value, z: Value) -> Value:
    """Three numbers as one value."""
    return graph.program.emit("combine", _first, x=x, y=y, z=z, w=ONE)


def read_separate(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Separate XYZ."""
    return graph.value(node.inputs[0], scope).part(output.name.lower())


def read_combine(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Combine XYZ."""
    x, y, z = (graph.value(socket, scope) for socket in node.inputs)
    return combined(graph, x, y, z)


def _first(*numbers: Numbers) -> Any:
    return [number[0] for number in numbers]


def unit(a: Numbers) -> Numbers:
    """(3,) as long as 1; 0 stays. Of a vector alone: the last bits of triangles.unit are others."""
    length = np.linalg.norm(a)
    return a / length if length > 0.0 else np.zeros(3)


def _projected(a: Numbers, b: Numbers) -> Numbers:
    squared = b @ b
    return b * (a @ b / squared) if squared > 0.0 else np.zeros(3)


def _refracted(a: Numbers, b: Numbers, index: Numbers) -> Numbers:
    normal, eta = unit(b), index[0]
    cosine = normal @ a
    squared = 1.0 - eta * eta * (1.0 - cosine * cosine)
    return eta * a - (eta * cosine + np.sqrt(squared)) * normal if squared >= 0.0 else np.zeros(3)


# The numbers of glsl/nodes/vector.glsl, and what of constants gives the same.
VECTOR: dict[str, tuple[int, Callable[[Numbers, Numbers, Numbers], Any]]] = {
    "CROSS_PRODUCT": (0, lambda a, b, c: np.cross(a, b)),
    "PROJECT": (1, lambda a, b, c: _projected(a, b)),
    "REFLECT": (2, lambda a, b, c: a - 2.0 * (unit(b) @ a) * unit(b)),
    "REFRACT": (3, _refracted),
    "FACEFORWARD": (4, lambda a, b, c: a if c @ b < 0.0 else -a),
    "DOT_PRODUCT": (5, lambda a, b, c: a @ b),
    "DISTANCE": (6, lambda a, b, c: np.linalg.norm(a - b)),
    "LENGTH": (7, lambda a, b, c: np.linalg.norm(a)),
    "NORMALIZE": (8, lambda a, b, c: unit(a)),
}
