# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture Coordinate and UV Map: what the corners of triangles have, and where a point is."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope
from ..programs import Value
from .geometry import GEOMETRY

GENERATED = "generated"
NORMAL = "normal"  # of the object's space, unit
TANGENT = "tangent"  # of a UV map's name, with the sign of the bitangent
UV = "uv"  # of a name; without one the map that is active in renders


def attribute(graph: Graph, *what: str) -> Value:
    """What the corners of the meshes have of a kind, and maybe a name."""
    number = Value.of(graph.asked.attribute(*what))
    if what[0] in (NORMAL, TANGENT):  # of the point itself, as in Cycles
        return graph.program.emit("attribute", number=number, shift=Value.of((0.0, 0.0, 0.0, 0.0)))
    return graph.program.emit("attribute", number=number)


def here(graph: Graph, what: str) -> Value:
    """What a point knows of itself, one of GEOMETRY."""
    return graph.program.emit("geometry", which=Value.of(GEOMETRY[what]))


def read_coordinate(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read an output of Texture Coordinate."""
    if getattr(node, "from_instancer", False) and output.name in ("Generated", "UV"):
        what = "the object's own are used"
        graph.notes.approximated(graph.owner, "Coordinates of the instancer", what)
    match output.name:
        case "Generated":
            return attribute(graph, GENERATED)
        case "Normal":
            if any(graph.program.shift):
                what = "a bump by them is flat"
                graph.notes.approximated(graph.owner, "Normal coordinates", what)
            return here(graph, "object normal")
        case "UV":
            return attribute(graph, UV, "")
        case "Object":
            if node.object is not None:
                what = "those of the object itself are used"
                graph.notes.approximated(graph.owner, "Coordinates of another object", what)
            return here(graph, "object position")
    graph.notes.approximated(graph.owner, f"{output.name} coordinates", "0 is used")
    return Value.of(0.0)


def read_uv_map(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read UV Map."""
    return attribute(graph, UV, node.uv_map)
