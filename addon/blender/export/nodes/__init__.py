# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give numbers, colours and vectors: a reader a kind, found by Blender's node type."""

from __future__ import annotations

import bpy

from ..graph import Asked, Colour, Graph, Reader
from ..report import Notes
from . import attributes, constants, geometry, maths, vectors

READERS: dict[str, Reader] = {
    "COMBXYZ": vectors.read_combine,
    "MATH": maths.read,
    "NEW_GEOMETRY": geometry.read,
    "RGB": constants.read,
    "SEPXYZ": vectors.read_separate,
    "TEX_COORD": attributes.read_coordinate,
    "UVMAP": attributes.read_uv_map,
    "VALUE": constants.read,
    "VECT_MATH": vectors.read_math,
}


def graph_of(
    tree: bpy.types.NodeTree,
    owner: str,
    notes: Notes,
    averages: dict[str, Colour | None] | None = None,
    asked: Asked | None = None,
) -> Graph:
    """A node tree with all readers; `asked` of meshes, if any there is."""
    return Graph(
        tree, owner, notes, READERS, {} if averages is None else averages, asked or Asked()
    )
