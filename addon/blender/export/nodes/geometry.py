# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry: what a point knows of itself."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ZERO, Value

# The numbers of glsl/nodes/geometry.glsl.
GEOMETRY = {
    "position": 0,
    "object position": 1,
    "normal": 2,
    "object normal": 3,
    "true normal": 4,
    "incoming": 5,
    "backfacing": 6,
    "parametric": 7,
    "object normal there": 8,
}


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read an output."""
    if output.name == "Normal" and graph.displaced:
        return graph.displaced
    if graph.volume:
        return graph.nothing_in_volume(output.name)
    return graph.program.emit("geometry", which=Value.of(GEOMETRY[output.name.lower()]))


def read_wireframe(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Wireframe, whose wires are as wide as it says in metres; in pixels there are none."""
    if node.use_pixel_size:
        graph.notes.approximated(graph.owner, "Wireframe in pixels", "0 is used")
        return ZERO
    return graph.program.emit("wireframe", size=graph.input(node, "Size", scope))
