# SPDX-License-Identifier: GPL-3.0-or-later
"""Normal Map and Bump: world space normals; Displacement and Vector Displacement: ways in world
space, of which Cycles by default makes a bump too."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope, linked
from ..programs import ONE, ZERO, Value, value
from .attributes import NORMAL, TANGENT, UNDISPLACED, attribute, here, smooth
from .mapping import in_space, normalized
from .vectors import combined

SPACES = {"TANGENT": 0, "OBJECT": 1, "WORLD": 2, "BLENDER_OBJECT": 3, "BLENDER_WORLD": 4}
# The default of a Bump node's Filter Width, and that of displacement [px]. Before Blender 4.5 there
# was no such input, and heights were asked a pixel away.
WIDTH = 0.1 if bpy.app.version >= (4, 5) else 1.0


def read_normal_map(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Normal Map."""
    in_tangents = node.space == "TANGENT"
    is_moved = graph.undisplaced or graph.displaced
    if in_tangents and is_moved and getattr(node, "base", "ORIGINAL") == "DISPLACED":
        what = "of the surface as it was before it was displaced"
        graph.notes.approximated(graph.owner, "Normal Map's Base", what)
    colour = graph.input(node, "Color", scope)
    if getattr(node, "convention", "OPENGL") == "DIRECTX":  # from Blender 5.2 on
        colour = combined(graph, colour.part("x"), ONE - colour.part("y"), colour.part("z"))
    normal = attribute(graph, NORMAL) if in_tangents else smooth(graph)
    if in_tangents and bpy.app.version >= (5, 2) and not is_moved:
        normal = normalized(graph, normal)
    return graph.program.emit(
        "normal_map",
        colour=colour,
        tangent=attribute(graph, TANGENT, node.uv_map) if in_tangents else ZERO,
        normal=normal,
        strength=graph.input(node, "Strength", scope),
        space=Value.of(SPACES[node.space]),
    )


def read_bump(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Bump."""
    normal = graph.input(node, "Normal", scope) if linked(node, "Normal", scope) else smooth(graph)
    if not linked(node, "Height", scope) or normal.is_just(0.0):
        return normal
    width = graph.input(node, "Filter Width", scope) if "Filter Width" in node.inputs else None
    wide = width.number if width is not None and width.is_constant else WIDTH
    distance = graph.input(node, "Distance", scope)
    heights = graph.beside(node.inputs["Height"], scope, wide)
    strength = graph.input(node, "Strength", scope)
    return bent(
        graph, normal, heights, distance * -1.0 if node.invert else distance, strength, wide
    )


def bent(
    graph: Graph,
    normal: Value,
    heights: tuple[Value, Value, Value],
    distance: Value,
    strength: Value,
    width: float,
) -> Value:
    """A normal bent by heights at a point, and along and across from it."""
    if all(height == heights[0] for height in heights) or distance.is_just(0.0):
        return normal
    height, along, across = heights
    return graph.program.emit(
        "bump",
        normal=normal,
        height=height,
        along=along,
        across=across,
        strength=strength,
        distance=distance,
        width=Value.of(width),
    )


def read_displacement(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Displacement."""
    height, midlevel, scale = (graph.input(node, x, scope) for x in ("Height", "Midlevel", "Scale"))
    up = graph.input(node, "Normal", scope) if linked(node, "Normal", scope) else smooth(graph)
    if node.space == "OBJECT":
        up = graph.program.emit("in_world", direction=graph.program.emit("in_object", normal=up))
    return up * ((height - midlevel) * scale)


def read_vector_displacement(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Vector Displacement."""
    vector, midlevel, scale = (graph.input(node, x, scope) for x in ("Vector", "Midlevel", "Scale"))
    way = (vector - midlevel) * scale
    if node.space == "TANGENT":
        frame = graph.program.emit(
            "tangent_space",
            vector=way,
            tangent=attribute(graph, TANGENT, ""),
            normal=graph.program.emit("in_object", normal=smooth(graph)),
        )
        return graph.program.emit("in_world", direction=frame)
    return graph.program.emit("in_world", direction=way) if node.space == "OBJECT" else way


def bump_of_displacement(graph: Graph, socket: bpy.types.NodeSocket) -> Value | None:
    """The normal that a material's displacement makes; None if that is the mesh's own."""
    normal = here(graph, "normal")
    ways = graph.beside(socket, (), WIDTH)
    height, along, across = ((way * normal).part("average") * 3.0 for way in ways)
    if graph.undisplaced:
        found = bent_in_object(graph, normal, (height, along, across))
    else:
        found = bent(graph, normal, (height, along, across), value(1.0), value(1.0), WIDTH)
    return None if found == normal else found


def bent_in_object(graph: Graph, normal: Value, heights: tuple[Value, Value, Value]) -> Value:
    """A normal bent by heights where the surface was, and along and across from there, with the
    lengths of the object's space, as in Cycles."""
    if all(height == heights[0] for height in heights):
        return normal
    number = value(graph.context.attribute(UNDISPLACED))
    ways = [
        graph.program.emit("attribute", number=number, shift=Value.of((x, y, 1.0, 0.0)))
        for x, y in ((WIDTH, 0.0), (0.0, WIDTH))
    ]
    height, along, across = heights
    found = graph.program.emit(
        "object_bump",
        normal=in_space(graph, normal, 2),
        height=height,
        along=along,
        across=across,
        way_along=ways[0],
        way_across=ways[1],
    )
    return in_space(graph, found, 5)
