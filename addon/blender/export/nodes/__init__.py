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
    colours,
    constants,
    curves,
    gabor,
    geometry,
    glow,
    gradient,
    image_texture,
    magic,
    maths,
    mixes,
    noise,
    normals,
    ranges,
    vectors,
    voronoi,
    wave,
    white_noise,
)

READERS: dict[str, Reader] = {
    "BLACKBODY": glow.read_blackbody,
    "BRIGHTCONTRAST": colours.read_contrast,
    "BUMP": normals.read_bump,
    "CLAMP": ranges.read_clamp,
    "COMBINE_COLOR": colours.read_combine,
    "COMBXYZ": vectors.read_combine,
    "CURVE_FLOAT": curves.read_float_curve,
    "CURVE_RGB": curves.read_curves,
    "CURVE_VEC": curves.read_curves,
    "DISPLACEMENT": normals.read_displacement,
    "GAMMA": colours.read_gamma,
    "HUE_SAT": colours.read_hue_saturation,
    "INVERT": colours.read_invert,
    "MAP_RANGE": ranges.read_map_range,
    "MATH": maths.read,
    "MIX": mixes.read,
    "MIX_RGB": mixes.read_old,
    "NEW_GEOMETRY": geometry.read,
    "NORMAL_MAP": normals.read_normal_map,
    "RGB": constants.read,
    "RGBTOBW": colours.read_grey,
    "SEPARATE_COLOR": colours.read_separate,
    "SEPXYZ": vectors.read_separate,
    "TEX_BRICK": brick.read,
    "TEX_CHECKER": checker.read,
    "TEX_COORD": attributes.read_coordinate,
    "TEX_GABOR": gabor.read,
    "TEX_GRADIENT": gradient.read,
    "TEX_IMAGE": image_texture.read,
    "TEX_MAGIC": magic.read,
    "TEX_NOISE": noise.read,
    "TEX_VORONOI": voronoi.read,
    "TEX_WAVE": wave.read,
    "TEX_WHITE_NOISE": white_noise.read,
    "UVMAP": attributes.read_uv_map,
    "VALTORGB": curves.read_ramp,
    "VALUE": constants.read,
    "VECTOR_DISPLACEMENT": normals.read_vector_displacement,
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
