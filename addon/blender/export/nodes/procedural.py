# SPDX-License-Identifier: GPL-3.0-or-later
"""What readers of procedural textures share: the place that a texture is asked about."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .attributes import GENERATED
from .texture_vector import texture_vector

# What instructions have of a place, by the dimensions of a texture.
PLACES = {"1D": ("w",), "2D": ("vector",), "3D": ("vector",), "4D": ("vector", "w")}


def vector(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    """The coordinates of a texture: generated ones if nothing is linked."""
    return texture_vector(graph, node, scope, GENERATED)


def place(graph: Graph, node: bpy.types.Node, scope: Scope, dimensions: str) -> dict[str, Value]:
    """The operands that say where a texture of "1D" to "4D" is asked."""
    operands = {}
    for name in PLACES[dimensions]:
        if name == "vector":
            operands[name] = vector(graph, node, scope)
        else:
            operands[name] = graph.input(node, "W", scope)
    return operands


def whole_place(
    graph: Graph, node: bpy.types.Node, scope: Scope, dimensions: str
) -> dict[str, Value]:
    """The same for instructions that have both operands, whatever the dimensions."""
    none = Value.of(0.0)
    return {"vector": none, "w": none} | place(graph, node, scope, dimensions)


def numbers(graph: Graph, node: bpy.types.Node, scope: Scope, *names: str) -> dict[str, Value]:
    """Inputs by their names in Blender, as operands: "Detail Scale" is detail_scale. Those that a
    node's options leave out are 0: nothing asks for them."""
    return {name.lower().replace(" ", "_"): graph.input(node, name, scope, 0.0) for name in names}


def choice(value: float) -> Value:
    """A constant that says what is computed."""
    return Value.of(float(value))
