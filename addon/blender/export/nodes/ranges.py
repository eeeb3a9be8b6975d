# SPDX-License-Identifier: GPL-3.0-or-later
"""Map Range and Clamp."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ZERO, Value, math, mix

SMOOTH = {"SMOOTHSTEP", "SMOOTHERSTEP"}


def read_map_range(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Map Range, of numbers or of vectors."""
    of_vectors = node.data_type == "FLOAT_VECTOR"
    sockets = node.inputs[6:] if of_vectors else node.inputs[:6]
    value, low, high, to_low, to_high = (graph.value(socket, scope) for socket in sockets[:5])
    kind = node.interpolation_type
    span = high - low
    if span.is_just(0.0) and not of_vectors:
        return ZERO
    share = (value - low) / span
    if kind in SMOOTH:
        share = math(kind, share)
    elif kind == "STEPPED":
        steps = graph.value(sockets[5], scope)
        share = math("FLOOR", share * (steps + 1.0)) / steps
        share = share * math("GREATER_THAN", steps, 0.0)
    result = mix(to_low, to_high, share)
    if not of_vectors and not span.is_constant:  # no span: 0, where vectors have the low end
        result = result * math("SIGN", math("ABSOLUTE", span))
    if node.clamp and kind not in SMOOTH:
        ends = math("MINIMUM", to_low, to_high), math("MAXIMUM", to_low, to_high)
        result = math("CLAMP", result, *ends)
    return result


def read_clamp(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Clamp."""
    value, low, high = (graph.value(socket, scope) for socket in node.inputs)
    if node.clamp_type == "RANGE":
        low, high = math("MINIMUM", low, high), math("MAXIMUM", low, high)
    return math("CLAMP", value, low, high)
