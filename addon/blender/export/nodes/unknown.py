# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that are not rendered, but have a value that they often have: each is noted."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope, is_given
from ..programs import ONE, ZERO, Value
from .attributes import smooth


def read_bevel(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Note Bevel: the normal as it is."""
    if graph.input(node, "Radius", scope).may_exceed(0.0):
        graph.notes.approximated(graph.owner, "Bevel", "edges are sharp")
    if is_given(node.inputs["Normal"], scope):
        return graph.input(node, "Normal", scope)
    return smooth(graph)


def read_occlusion(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Note Ambient Occlusion: nothing is near."""
    graph.notes.approximated(graph.owner, "Ambient Occlusion", "nothing occludes")
    return graph.input(node, "Color", scope) if output.name == "Color" else ONE


def read_script(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Note an OSL script: nothing."""
    graph.notes.approximated(graph.owner, f"Script '{node.name}'", "0 is used")
    return ZERO
