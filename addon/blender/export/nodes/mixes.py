# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix, and Mix Color of older files."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..graph import Graph
from ..hsv import BLENDS, HUE_BLENDS, Blend
from ..links import Scope
from ..programs import ZERO, Value, math, mix

Numbers = NDArray[np.float64]
SUFFIXES = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}  # of sockets' identifiers


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read Mix, of the type that its output has."""
    suffix = SUFFIXES.get(node.data_type)
    if suffix is None:
        graph.notes.approximated(graph.owner, f"Mix of {node.data_type.lower()}s", "0 is used")
        return ZERO
    a, b = (graph.value(_named(node, f"{x}_{suffix}"), scope) for x in "AB")
    by_channel = node.data_type == "VECTOR" and node.factor_mode == "NON_UNIFORM"
    share = graph.value(_named(node, f"Factor_{'Vector' if by_channel else 'Float'}"), scope)
    share = share.clamp() if node.clamp_factor else share
    if node.data_type != "RGBA":
        return mix(a, b, share)
    result = blended(graph, node.blend_type, a, b, share)
    return result.clamp() if node.clamp_result else result


def read_old(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Mix Color as it was before Blender 3.4."""
    share, a, b = (graph.value(socket, scope) for socket in node.inputs)
    result = blended(graph, node.blend_type, a, b, share.clamp())
    return result.clamp() if node.use_clamp else result


def _named(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket:
    return next(socket for socket in node.inputs if socket.identifier == identifier)


def blended(graph: Graph, blend: str, a: Value, b: Value, share: Value) -> Value:
    """Two colours, blended by as much as the share says."""
    match blend:
        case "MIX":
            return mix(a, b, share)
        case "ADD":
            return math("MULTIPLY_ADD", b, share, a)
        case "SUBTRACT":
            return math("MULTIPLY_ADD", b, 0.0 - share, a)
        case "MULTIPLY":
            return mix(a, a * b, share)
        case "DARKEN":
            return mix(a, math("MINIMUM", a, b), share)
        case "LIGHTEN":
            return mix(a, math("MAXIMUM", a, b), share)
        case "DIFFERENCE":
            return mix(a, math("ABSOLUTE", a - b), share)
        case "LINEAR_LIGHT":
            return math("MULTIPLY_ADD", math("MULTIPLY_ADD", b, 2.0, -1.0), share, a)
    kind, known = ("blend", BLENDS) if blend in BLENDS else ("blend_hue", HUE_BLENDS)
    number, function = known[blend]
    fold = _fold(function)
    return graph.program.emit(kind, fold, a=a, b=b, share=share, blend=Value.of(number))


def _fold(function: Blend) -> Any:
    def fold(a: Numbers, b: Numbers, share: Numbers, _: Numbers) -> Any:
        return function(a[:3], b[:3], float(share[0]))

    return fold
