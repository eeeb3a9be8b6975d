# SPDX-License-Identifier: GPL-3.0-or-later
"""What is inside a mesh: a Volume Absorption of one colour; other volumes are reported."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import is_given, source
from ..programs import ZERO, Value, math


def absorption(graph: Graph, output: bpy.types.Node, has_surface: bool) -> Value:
    """What light loses on its way [1/m]: density * (1 - colour), as in Cycles; ZERO of what is not
    rendered, which is noted."""
    if not is_given(output.inputs["Volume"], ()):
        return ZERO
    node, _, scope = source(output.inputs["Volume"], ())
    if node is None or node.type != "VOLUME_ABSORPTION" or not has_surface:
        graph.notes.ignored(graph.owner, "Volume", "not rendered")
        return ZERO
    density = math("MAXIMUM", graph.input(node, "Density", scope), 0.0)
    lost = math("MAXIMUM", 1.0 - graph.input(node, "Color", scope), 0.0) * density
    if not lost.is_constant:
        graph.notes.ignored(graph.owner, "Volume", "it differs from point to point: none")
        return ZERO
    return lost
