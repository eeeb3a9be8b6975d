# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a texture node is asked: its Vector."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope, is_given
from ..programs import Value
from ..report import Notes
from .attributes import attribute


def texture_vector(graph: Graph, node: bpy.types.Node, scope: Scope, *unlinked: str) -> Value:
    """The coordinates of a texture; without a link the attribute `unlinked`."""
    note_mapping(node, graph.owner, graph.notes)
    socket = node.inputs["Vector"]
    return graph.value(socket, scope) if is_given(socket, scope) else attribute(graph, *unlinked)


def note_mapping(node: bpy.types.Node, owner: str, notes: Notes) -> None:
    """Write down that a node's own mapping, of old files, is left out."""
    mapping = node.texture_mapping
    axes = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z)
    moved = any(mapping.translation) or any(mapping.rotation) or tuple(mapping.scale) != (1, 1, 1)
    if moved or axes != ("X", "Y", "Z") or mapping.use_min or mapping.use_max:
        what = "the node's own mapping, of old files, is left out"
        notes.approximated(owner, f"Texture Mapping of '{node.name}'", what)
