# SPDX-License-Identifier: GPL-3.0-or-later
"""Magic Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import choice, numbers, vector


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the colour, or its mean."""
    result = graph.program.emit(
        "magic",
        vector=vector(graph, node, scope),
        **numbers(graph, node, scope, "Scale", "Distortion"),
        depth=choice(node.turbulence_depth),
    )
    return result if output.identifier == "Color" else result.part("w")
