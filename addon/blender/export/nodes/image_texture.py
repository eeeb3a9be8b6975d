# SPDX-License-Identifier: GPL-3.0-or-later
"""Image Texture and Environment Texture: colour and alpha of an image at a place."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..colour_spaces import decoded
from ..graph import Graph
from ..links import Scope, is_given
from ..programs import Value
from ..textures import Found, is_separated
from .attributes import UV, here, object_normal
from .texture_vector import note_mapping, texture_vector

# The numbers of glsl/lib/image.glsl and glsl/nodes/image.glsl.
TEXELS = {"Closest": 1, "Linear": 2, "Cubic": 4, "Smart": 4}
EXTENSIONS = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3}
PROJECTIONS = {"FLAT": 0, "BOX": 1, "SPHERE": 2, "TUBE": 3}
DIRECTIONS = {"EQUIRECTANGULAR": 4, "MIRROR_BALL": 5}


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read Color or Alpha; without a vector the UV map that is active in renders is used."""
    found = graph.textures.find(graph.owner, node) if graph.textures else Found(0)
    # As in Cycles, whose colours are multiplied by an alpha that nobody asks for.
    separated = node.outputs["Alpha"].is_linked and is_separated(node.image)
    if found.constant is not None:
        value = Value.of(_constant(found, separated))
    else:
        is_box = node.projection == "BOX"
        value = graph.program.emit(
            "image",
            vector=texture_vector(graph, node, scope, UV, ""),
            normal=object_normal(graph) if is_box else Value.of(0.0),
            image=Value.of(found.first),
            tiles=Value.of(0 if is_box else found.tiles),
            texels=Value.of(TEXELS[node.interpolation]),
            extension=Value.of(EXTENSIONS[node.extension]),
            projection=Value.of(PROJECTIONS[node.projection]),
            blend=Value.of(node.projection_blend),
            separated=Value.of(separated),
            faces=Value.of(3 if is_box else 1),
        )
        if graph.textures and graph.textures.is_unit(found):
            value = value.as_unit()
    return value.part("w") if output.name == "Alpha" else value


def read_environment(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read an Environment Texture of a surface; without a vector the position is the direction."""
    found = graph.textures.find(graph.owner, node) if graph.textures else Found(0)
    if found.constant is not None:
        return Value.of(_constant(found, separated=False))
    note_mapping(node, graph.owner, graph.notes)
    socket = node.inputs["Vector"]
    is_free = not is_given(socket, scope)
    return graph.program.emit(
        "image",
        vector=here(graph, "position") if is_free else graph.value(socket, scope),
        normal=Value.of(0.0),
        image=Value.of(found.first),
        tiles=Value.of(0),
        texels=Value.of(TEXELS[node.interpolation]),
        extension=Value.of(EXTENSIONS["REPEAT"]),
        projection=Value.of(DIRECTIONS[node.projection]),
        blend=Value.of(0.0),
        separated=Value.of(0.0),
        faces=Value.of(1),
    )


def _constant(found: Found, separated: bool) -> NDArray[np.float64]:
    """Colour and alpha (4,) of an image of one texel."""
    assert found.constant is not None
    value = found.constant.copy()
    if separated and value[3] not in (0.0, 1.0):
        value[:3] /= value[3]
    if found.is_srgb:
        value[:3] = decoded(value[:3])
    return value
