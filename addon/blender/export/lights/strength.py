# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's nodes multiply its power by."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..nodes import Graph, Scope, colour_of, source, value_of
from ..report import Notes
from .blackbody import blackbody

# Powers of the distance in the sockets of Light Falloff, by name.
FALLOFFS = {"Quadratic": 0, "Linear": 1, "Constant": 2}


@dataclass(frozen=True)
class Strength:
    """A factor a channel, and how it goes with the distance, as in Light."""

    colour: NDArray[np.float64]
    falloff: int = 0
    smoothing: float = 0.0

    @property
    def varies(self) -> bool:
        return bool(self.falloff or self.smoothing)


def strength_of(tree: bpy.types.NodeTree, owner: str, notes: Notes) -> Strength:
    """Return colour times strength of the light's Emission node."""
    graph = Graph(tree, owner, notes)
    node, scope = graph.surface("OUTPUT_LIGHT")
    if node is None:
        return Strength(np.zeros(3))
    if node.type != "EMISSION":
        notes.approximated(owner, "Nodes", "no plain Emission: its own colour is used")
        return Strength(np.ones(3))
    found = _strength(graph, node.inputs["Strength"], scope)
    return replace(found, colour=found.colour * _colour(graph, node.inputs["Color"], scope))


def _colour(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope) -> NDArray[np.float64]:
    node, _, inner = source(socket, scope)
    if node is not None and node.type == "BLACKBODY":
        return blackbody(value_of(graph, node.inputs["Temperature"], inner))
    return np.array(colour_of(graph, socket, scope))


def _strength(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope) -> Strength:
    node, end, inner = source(socket, scope)
    if node is not None and node.type == "LIGHT_FALLOFF":
        found = _strength(graph, node.inputs["Strength"], inner)
        smoothing = value_of(graph, node.inputs["Smooth"], inner)
        return replace(found, falloff=FALLOFFS[end.name], smoothing=max(0.0, smoothing))
    if node is not None and node.type == "MATH" and node.operation == "MULTIPLY":
        first, second = (_strength(graph, node.inputs[index], inner) for index in (0, 1))
        if not (first.varies and second.varies):
            varying, constant = (first, second) if first.varies else (second, first)
            return replace(varying, colour=varying.colour * constant.colour)
    return Strength(np.full(3, value_of(graph, socket, scope)))
