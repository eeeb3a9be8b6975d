# SPDX-License-Identifier: GPL-3.0-or-later
"""What the kitchen is made of: coarse meshes that modifiers round, so that the file is small; and
where things stand in it [m].

Wood, clay and ceramic take their colours from the objects.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
import scene_parts
from scene_parts import corners_of, mesh_object

LEFT, RIGHT, FRONT, BACK, TOP = -1.9, 1.9, -1.9, 2.2, 2.55
TABLE, TABLE_TOP, TABLE_TURN = (-0.15, 0.42), 0.745, -11.0
COUNTER_TOP, SHELF = 0.905, 1.52
OAK, PINE, DARK = (0.50, 0.30, 0.145), (0.66, 0.47, 0.26), (0.16, 0.085, 0.04)
BLUE, GREEN, RED = (0.035, 0.10, 0.21), (0.12, 0.21, 0.13), (0.34, 0.05, 0.035)
CLAY, EARTH, BREAD = (0.55, 0.24, 0.14), (0.12, 0.07, 0.045), (0.66, 0.36, 0.13)


def boxes(
    name: str, mat, parts: Sequence, at=(0, 0, 0), turn=0.0, colour=None, edge=0.004
) -> bpy.types.Object:
    """Boxes between pairs of corners as one object, their edges bevelled."""
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3)]
    corners = [corner for low, high in parts for corner in corners_of(low, high)]
    faces = [tuple(8 * i + k for k in side) for i in range(len(parts)) for side in sides]
    obj = mesh_object(name, [mat], corners, faces)
    obj.location, obj.rotation_euler = at, (0, 0, math.radians(turn))
    edges = obj.modifiers.new("Edges", "BEVEL")
    edges.width, edges.segments = edge, 2
    return coloured(obj, colour)


def coloured(obj: bpy.types.Object, colour) -> bpy.types.Object:
    if colour:
        obj.color = (*colour, 1)
    return obj


def softened(obj: bpy.types.Object, levels: int = 2) -> bpy.types.Object:
    smooth = obj.modifiers.new("Smooth", "SUBSURF")
    smooth.levels = smooth.render_levels = levels
    return obj


def turned(name: str, mat, profile: Sequence, at=(0, 0, 0), colour=None, segments: int = 16):
    """A profile of (radius, height) about the z axis, rounded: it passes near its points."""
    wider = 3 / (2 + math.cos(2 * math.pi / segments))  # a subdivided ring shrinks
    corners, faces = [], []
    scene_parts.turned([(r * wider, z) for r, z in profile], segments, corners, faces)
    obj = softened(mesh_object(name, [mat], corners, faces, smooth=True))
    obj.location = at
    return coloured(obj, colour)


def tube(name: str, mat, path, radius, rings: int = 8, segments: int = 8, colour=None):
    """scene_parts' tube, coarse and rounded."""
    obj = scene_parts.tube(name, mat, path, radius, rings, segments)
    return coloured(softened(obj), colour)


def again(obj: bpy.types.Object, at, turn: float = 0.0, colour=None) -> bpy.types.Object:
    """The same mesh in another place."""
    other = obj.copy()
    other.location, other.rotation_euler = at, (0, 0, math.radians(turn))
    bpy.context.scene.collection.objects.link(other)
    return coloured(other, colour)


def unwrap(obj: bpy.types.Object, places: Sequence) -> None:
    """A UV map of a place for each corner of the mesh."""
    which = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", which)
    layer = obj.data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.asarray(places, np.float32)[which].ravel())


def on_table(x: float, y: float, z: float = 0.0) -> tuple[float, float, float]:
    """The place above the table's own x and y."""
    a = math.radians(TABLE_TURN)
    return (
        TABLE[0] + x * math.cos(a) - y * math.sin(a),
        TABLE[1] + x * math.sin(a) + y * math.cos(a),
        TABLE_TOP + z,
    )
