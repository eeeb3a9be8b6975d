# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that stand for others where Blender evaluates a graph for each direction, as
world_nodes.StandIn gives them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray


def made(
    kind: str,
    links: dict[int, tuple[int, int]] | None = None,
    values: dict[int, Any] | None = None,
    **properties: Any,
) -> dict[str, Any]:
    """A node as world_nodes describes it; the first output. A Texture Coordinate's is Generated:
    the direction."""
    described = {"kind": kind, "properties": properties, "values": values or {}}
    return {**described, "links": links or {}, "output": 0}


def dot(row: Any) -> dict[str, Any]:
    """The product of the first node and (3,)."""
    values = {1: [float(x) for x in row]}
    return {
        **made("ShaderNodeVectorMath", {0: (0, 0)}, values, operation="DOT_PRODUCT"),
        "output": 1,
    }


def combined(rows: NDArray[Any]) -> Iterator[dict[str, Any]]:
    """A matrix (3, 3) times the first node, which these follow."""
    yield from map(dot, rows)
    yield made("ShaderNodeCombineXYZ", {0: (1, 1), 1: (2, 1), 2: (3, 1)})
