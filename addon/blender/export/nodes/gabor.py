# SPDX-License-Identifier: GPL-3.0-or-later
"""Gabor Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import numbers, vector

PARTS = {"Value": "x", "Phase": "y", "Intensity": "z"}


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the value, the phase or the intensity."""
    # Two inputs have one name.
    wanted = f"Orientation {node.gabor_type}"
    orientation = next(socket for socket in node.inputs if socket.identifier == wanted)
    result = graph.program.emit(
        f"gabor_{node.gabor_type.lower()}",
        vector=vector(graph, node, scope),
        **numbers(graph, node, scope, "Scale", "Frequency", "Anisotropy"),
        orientation=graph.value(orientation, scope),
    )
    return result.part(PARTS[output.identifier])
