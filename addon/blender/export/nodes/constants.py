# SPDX-License-Identifier: GPL-3.0-or-later
"""RGB and Value."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """What the output itself holds."""
    value = output.default_value
    return Value.of(value if isinstance(value, float) else value[:])
