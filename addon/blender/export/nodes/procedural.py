# SPDX-License-Identifier: GPL-3.0-or-later
"""What readers of procedural textures share: the place that a texture is asked about."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope, is_given
from ..programs import Value
from .attributes import GENERATED, attribute

# What instructions have of a place, by the dimensions of a texture.
PLACES = {"1D": ("w",), "2D": ("vector",), "3D": ("vector",), "4D": ("vector", "w")}


def vector(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    """The coordinates of a texture: generated ones if nothing is linked."""
    mapping = node.texture_mapping
    axes = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z)
    moved = any(mapping.translation) or any(mapping.rotation) or tuple(mapping.scale) != (1, 1, 1)
    if moved or axes != ("X", "Y", "Z") or mapping.use_min or mapping.use_max:
        feature = f"Texture Mapping of '{node.name}'"
        graph.notes.approximated(graph.owner, feature, "coordinates are used as they are")
    socket = node.inputs["Vector"]
    if not is_given(socket, scope):
        return attribute(graph, GENERATED)
    return graph.value(socket, scope)


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


def number(graph: Graph, node: bpy.types.Node, scope: Scope, name: str) -> Value:
    """An input by its name; 0 where the node's options leave it out, and nothing asks for it."""
    socket = node.inputs.get(name)
    return Value.of(0.0) if socket is None else graph.value(socket, scope)


def numbers(graph: Graph, node: bpy.types.Node, scope: Scope, *names: str) -> dict[str, Value]:
    """Inputs by their names in Blender, as operands: "Detail Scale" is detail_scale."""
    return {name.lower().replace(" ", "_"): number(graph, node, scope, name) for name in names}


def choice(value: float) -> Value:
    """A constant that says what is computed."""
    return Value.of(float(value))
