# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry: what a point knows of itself."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope
from ..programs import Value

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
}


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read an output; Pointiness and Random Per Island are noted."""
    if output.name == "Normal" and graph.displaced:
        return graph.displaced
    which = GEOMETRY.get(output.name.lower())
    if which is None:
        value = 0.5 if output.name == "Pointiness" else 0.0
        graph.notes.approximated(graph.owner, f"Geometry's {output.name}", f"{value:g} is used")
        return Value.of(value)
    return graph.program.emit("geometry", which=Value.of(which))
