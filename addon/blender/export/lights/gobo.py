# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose colour differs from direction to direction, such as slides before a spotlight, and
area lights on which it does from place to place: what their nodes make of each, as an image.
Blender itself evaluates them, as it does a world's (world_nodes.py)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..links import Scope, source
from ..made_nodes import combined, dot, made
from ..world_nodes import OF_SURFACES, StandIn, Tell, Unsuited, evaluate

KINDS = {"POINT", "SPOT", "AREA"}
WIDTH = 2048  # [px] of all around: a pixel is a hundredth of a cone of 18 degrees
# Outputs that tell the direction, by the nodes' types. Their normal is the light's own, towards
# what is lit.
BY_DIRECTION = {
    "TEX_COORD": {"Normal", "UV"},
    "NEW_GEOMETRY": {"Normal", "True Normal", "Incoming"},
}
# What depends on more, or what a world has not.
UNSUITED = {*OF_SURFACES, "TEX_COORD", "NEW_GEOMETRY", "LIGHT_FALLOFF", "TEX_IES", "TANGENT"}


def colours_of(
    light: Any,
    matrix: NDArray[np.float64],
    socket: bpy.types.NodeSocket,
    scope: Scope,
    tell: Tell | None = None,
) -> NDArray[np.float32] | None:
    """What an input has in each direction from a lamp that `matrix` places, float32 (height, width,
    3), up against the lamp's axis and its x axis in the middle, or at each place on an area light;
    None: the same in all; `tell`: as for `evaluate`. Raises Unsuited."""
    node, end, inner = source(socket, scope)
    if node is None or not _differs(node, end, inner, set()):
        return None
    if light.type not in KINDS:
        raise Unsuited("it is a sun")
    turn, is_flat = matrix[:3, :3], light.type == "AREA"
    lengths = np.linalg.norm(turn, axis=0)
    is_even = is_flat or np.ptp(lengths) <= 1e-4 * lengths.max()
    if lengths.min() <= 0.0 or np.linalg.det(turn) < 0.0 or not is_even:
        raise Unsuited("the lamp is scaled unevenly or mirrored")
    if is_flat and _differs(node, end, inner, set(), "UV"):
        raise Unsuited("an area light has other directions at each place")
    pixels: NDArray[np.float32] = evaluate(
        node, end, inner, stand_in=_stand_in(light, turn / lengths), least=WIDTH, tell=tell
    )
    return pixels


def _differs(
    node: bpy.types.Node,
    output: bpy.types.NodeSocket,
    scope: Scope,
    seen: set[Any],
    besides: str = "",
) -> bool:
    """Whether a node's output tells the direction, by other outputs than one of a name."""
    if output.name in BY_DIRECTION.get(node.type, set()) - {besides}:
        return True
    key = (node.as_pointer(), *(group.as_pointer() for group in scope))
    if key in seen:
        return False
    seen.add(key)
    for socket in node.inputs:
        feeding, end, inner = source(socket, scope)
        if feeding is None:
            if node.type == "TEX_IMAGE" and socket.name == "Vector" and besides != "UV":
                return True
        elif _differs(feeding, end, inner, seen, besides):
            return True
    return False


def _stand_in(light: Any, turn: NDArray[np.float64]) -> StandIn:
    """Of nodes of a lamp by those of a world whose direction is the lamp's, in its own axes."""

    def find(
        node: bpy.types.Node, output: bpy.types.NodeSocket | None
    ) -> list[dict[str, Any]] | None:
        if output is None and node.type == "TEX_IMAGE":
            return [*_uv(light)]
        name = output.name if output is not None else ""
        if name not in BY_DIRECTION.get(node.type, ()):
            if output is None or node.type in UNSUITED:
                raise Unsuited(f"'{node.name}' tells more than a direction")
            return None
        if name == "UV":
            return [*_uv(light)]
        if node.type == "TEX_COORD":
            return [made("ShaderNodeTexCoord")]
        return [made("ShaderNodeTexCoord"), *combined(turn)]

    return find


def _uv(light: Any) -> Iterator[dict[str, Any]]:
    """As Cycles has it: of a spotlight a square about its cone, in a plane before it; of points
    longitude and latitude. Of area lights that of their image."""
    yield made("ShaderNodeTexCoord")
    if light.type == "SPOT":
        half = 0.5 / math.tan(light.spot_size / 2.0)
        yield dot((0.0, 0.0, -1.0 / half))
        yield made("ShaderNodeVectorMath", {0: (0, 0)}, {1: [1.0, 1.0, 0.0]}, operation="MULTIPLY")
        yield made("ShaderNodeCombineXYZ", {0: (1, 1), 1: (1, 1)}, {2: 1.0})
        yield made("ShaderNodeVectorMath", {0: (2, 0), 1: (3, 0)}, operation="DIVIDE")
        yield made("ShaderNodeVectorMath", {0: (4, 0)}, {1: [0.5, 0.5, 0.0]}, operation="ADD")
        return
    yield made("ShaderNodeSeparateXYZ", {0: (0, 0)})
    is_flat = light.type == "AREA"
    x, y = (1, 0) if is_flat else (0, 1)
    yield made("ShaderNodeMath", {0: (1, x), 1: (1, y)}, operation="ARCTAN2")
    yield _scaled(2, -0.5 / math.pi, 0.5)
    yield made("ShaderNodeMath", {0: (1, 2)}, operation="ARCSINE" if is_flat else "ARCCOSINE")
    yield _scaled(4, 1.0 / math.pi, 0.5) if is_flat else _scaled(4, -1.0 / math.pi, 1.0)
    yield made("ShaderNodeCombineXYZ", {0: (3, 0), 1: (5, 0)})


def _scaled(number: int, factor: float, offset: float) -> dict[str, Any]:
    links = {0: (number, 0)}
    return made("ShaderNodeMath", links, {1: factor, 2: offset}, operation="MULTIPLY_ADD")
