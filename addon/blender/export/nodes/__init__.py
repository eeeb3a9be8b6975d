# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give numbers, colours and vectors: a reader a kind, found by Blender's node type."""

from __future__ import annotations

import bpy

from ..graph import Asked, Colour, Graph, Reader
from ..report import Notes
from . import (
    attributes,
    brick,
    checker,
    constants,
    gabor,
    geometry,
    glow,
    gradient,
    magic,
    maths,
    noise,
    vectors,
    voronoi,
    wave,
    white_noise,
)

READERS: dict[str, Reader] = {
    "BLACKBODY": glow.read_blackbody,
    "COMBXYZ": vectors.read_combine,
    "MATH": maths.read,
    "NEW_GEOMETRY": geometry.read,
    "RGB": constants.read,
    "SEPXYZ": vectors.read_separate,
    "TEX_BRICK": brick.read,
    "TEX_CHECKER": checker.read,
    "TEX_COORD": attributes.read_coordinate,
    "TEX_GABOR": gabor.read,
    "TEX_GRADIENT": gradient.read,
    "TEX_MAGIC": magic.read,
    "TEX_NOISE": noise.read,
    "TEX_VORONOI": voronoi.read,
    "TEX_WAVE": wave.read,
    "TEX_WHITE_NOISE": white_noise.read,
    "UVMAP": attributes.read_uv_map,
    "VALUE": constants.read,
    "VECT_MATH": vectors.read_math,
    "WAVELENGTH": glow.read_wavelength,
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
