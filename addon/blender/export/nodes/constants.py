# SPDX-License-Identifier: GPL-3.0-or-later
"""RGB and Value; since Blender 5.2 Integer, Boolean and Vector, which also stand for what it has
worked out, and conversions between types of sockets."""

from __future__ import annotations

import bpy

from ..graph import Graph, converted
from ..links import Scope
from ..programs import Value


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """What the output itself holds."""
    value = output.default_value
    return Value.of(value if isinstance(value, float) else value[:])


def read_typed(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """What a node of one type holds, by the name of that."""
    value = getattr(node, output.name.lower())
    return Value.of(float(value) if isinstance(value, int) else value[:3])


def read_conversion(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """What its input is as its output's type."""
    given = node.inputs[0]
    return converted(graph.value(given, scope), given.type, output.type)
