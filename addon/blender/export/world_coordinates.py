# SPDX-License-Identifier: GPL-3.0-or-later
"""Coordinates of a world that something places, the camera or an object: nodes that make them of
the direction, as Cycles does, to which that is a place a metre from the origin."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .camera import View
from .made_nodes import combined, made
from .world_nodes import StandIn


def placed_by(view: View | None) -> StandIn:
    """Of Texture Coordinate's Camera, Window and an object's; None for what a camera has not, as
    one without perspective, whose pixels all look in one direction."""

    def find(
        node: bpy.types.Node, output: bpy.types.NodeSocket | None
    ) -> list[dict[str, Any]] | None:
        if output is None or node.type != "TEX_COORD":
            return None
        if output.name == "Object" and node.object is not None:
            return _object(np.array(node.object.matrix_world, np.float64))
        if view and output.name == "Camera":
            return [made("ShaderNodeTexCoord"), *combined(view.to_camera[:3, :3])]
        if view and output.name == "Window" and view.camera.kind == "PERSP":
            return _window(view.to_window[:, :3])
        return None

    return find


def _object(matrix: NDArray[np.float64]) -> list[dict[str, Any]]:
    """A place in an object's space."""
    rows = np.linalg.pinv(matrix)[:3]
    offset = [float(x) for x in rows[:, 3]]
    moved = made("ShaderNodeVectorMath", {0: (4, 0)}, {1: offset}, operation="ADD")
    return [made("ShaderNodeTexCoord"), *combined(rows[:, :3]), moved]


def _window(rows: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Where the picture shows a direction, or its opposite: across and up over the depth."""
    depth = made("ShaderNodeCombineXYZ", {0: (3, 1), 1: (3, 1)}, {2: 1.0})
    over = made("ShaderNodeVectorMath", {0: (4, 0), 1: (5, 0)}, operation="DIVIDE")
    flat = made("ShaderNodeVectorMath", {0: (6, 0)}, {1: [1.0, 1.0, 0.0]}, operation="MULTIPLY")
    return [made("ShaderNodeTexCoord"), *combined(rows), depth, over, flat]
