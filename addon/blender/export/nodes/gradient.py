# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradient Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import choice, vector

# The numbers of glsl/nodes/gradient.glsl.
KINDS = {
    "LINEAR": 0,
    "QUADRATIC": 1,
    "EASING": 2,
    "DIAGONAL": 3,
    "RADIAL": 4,
    "QUADRATIC_SPHERE": 5,
    "SPHERICAL": 6,
}


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read either output: they are the same."""
    kind = choice(KINDS[node.gradient_type])
    return graph.program.emit("gradient", vector=vector(graph, node, scope), kind=kind)
