# SPDX-License-Identifier: GPL-3.0-or-later
"""Brick Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value, mix
from .procedural import choice, numbers, vector


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read how much mortar there is, or the colour of bricks and mortar."""
    found = graph.program.emit(
        "brick",
        vector=vector(graph, node, scope),
        **numbers(graph, node, scope, "Scale", "Mortar Size", "Mortar Smooth", "Bias"),
        width=graph.input(node, "Brick Width", scope),
        height=graph.input(node, "Row Height", scope),
        offset=choice(node.offset),
        squash=choice(node.squash),
        offset_frequency=choice(node.offset_frequency),
        squash_frequency=choice(node.squash_frequency),
    )
    if output.identifier != "Color":
        return found.part("w")
    first, second, mortar = (
        graph.input(node, name, scope) for name in ("Color1", "Color2", "Mortar")
    )
    return mix(mix(first, second, found.part("x")), mortar, found.part("w"))
