# SPDX-License-Identifier: GPL-3.0-or-later
"""White Noise Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import choice


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the value or the colour. Without a link the vector is the socket's own."""
    inputs = {"vector": Value.of(0.0), "w": Value.of(0.0)}
    if node.noise_dimensions != "1D":
        inputs["vector"] = graph.input(node, "Vector", scope)
    if node.noise_dimensions in ("1D", "4D"):
        inputs["w"] = graph.input(node, "W", scope)
    dimensions = choice(int(node.noise_dimensions[0]))
    result = graph.program.emit("white_noise", **inputs, dimensions=dimensions)
    return result if output.identifier == "Color" else result.part("x")
