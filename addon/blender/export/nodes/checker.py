# SPDX-License-Identifier: GPL-3.0-or-later
"""Checker Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value, mix
from .procedural import numbers, vector


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the factor, or one of two colours by it."""
    place = vector(graph, node, scope)
    first = graph.program.emit("checker", vector=place, **numbers(graph, node, scope, "Scale"))
    if output.identifier != "Color":
        return first
    others = graph.input(node, "Color2", scope)
    return mix(others, graph.input(node, "Color1", scope), first)
