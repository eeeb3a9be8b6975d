# SPDX-License-Identifier: GPL-3.0-or-later
"""Object Info, and what meshes are not: particles, hair, points, volumes."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ZERO, Value
from .attributes import PARTICLE, STRAND, attribute
from .mapping import in_space

# The numbers of glsl/nodes/object.glsl.
INFO = {"Location": 0, "Color": 1, "Alpha": 1, "Object Index": 2, "Random": 3}


def read_info(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Object Info."""
    if output.name == "Material Index":
        return Value.of(graph.context.index)
    if graph.volume == "world":
        return ZERO
    found = graph.program.emit("object", which=Value.of(INFO[output.name]))
    return found.part("w") if output.name == "Alpha" else found


def read_particle(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Particle Info."""
    return attribute(graph, PARTICLE, output.name)


def read_strand(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Hair and Point Info: of a mesh all is 0."""
    if output.name == "Tangent Normal":
        graph.notes.approximated(graph.owner, "Hair Info's Tangent Normal", "0 is used")
        return ZERO
    found = attribute(graph, STRAND, output.name)
    if (node.type, output.name) == ("POINT_INFO", "Position"):
        return in_space(graph, found, 3) * found.part("w")  # a mesh has none
    return found


def read_nothing(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Volume Info: of a mesh all is 0."""
    return ZERO
