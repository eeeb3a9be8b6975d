# SPDX-License-Identifier: GPL-3.0-or-later
"""Math: an operation of numbers."""

from __future__ import annotations

import bpy

from ..arithmetic import ARITHMETIC, FUNCTIONS
from ..graph import Graph
from ..links import Scope
from ..programs import Value, math

# How many of its inputs an operation has; the others have two.
ONE_INPUT = {
    *("SQRT", "INVERSE_SQRT", "ABSOLUTE", "EXPONENT", "SIGN", "ROUND", "FLOOR", "CEIL", "TRUNC"),
    *("FRACT", "SINE", "COSINE", "TANGENT", "ARCSINE", "ARCCOSINE", "ARCTANGENT", "SINH", "COSH"),
    *("TANH", "RADIANS", "DEGREES"),
}
THREE_INPUTS = {"MULTIPLY_ADD", "COMPARE", "SMOOTH_MIN", "SMOOTH_MAX", "WRAP"}


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the node; an operation that nobody knows gives 0, and is noted."""
    operation = node.operation
    if operation not in ARITHMETIC and operation not in FUNCTIONS:
        graph.notes.approximated(graph.owner, f"Math {operation}", "0 is used")
        return Value.of(0.0)
    count = 1 if operation in ONE_INPUT else 3 if operation in THREE_INPUTS else 2
    result = math(operation, *(graph.value(socket, scope) for socket in node.inputs[:count]))
    return result.clamp() if node.use_clamp else result
