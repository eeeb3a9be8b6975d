# SPDX-License-Identifier: GPL-3.0-or-later
"""Magic Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, Value
from .procedural import choice, numbers, vector


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the colour, or its mean."""
    at, given = vector(graph, node, scope), numbers(graph, node, scope, "Scale", "Distortion")
    if bpy.app.version >= (5, 2):  # its period is that of what is scaled
        at, given["scale"] = at * given["scale"], ONE
    result = graph.program.emit("magic", vector=at, **given, depth=choice(node.turbulence_depth))
    return result if output.identifier == "Color" else result.part("w")
