# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's nodes multiply its power by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..graph import Graph, colour_of, value_of
from ..links import Scope, source
from ..nodes import graph_of
from ..nodes.views import FALLOFFS
from ..report import Notes
from ..world_nodes import Unsuited
from .gobo import colours_of
from .ies import UNREADABLE, read_ies
from .lamp_nodes import readers_of


@dataclass(frozen=True)
class Strength:
    """A factor a channel, and how it goes with the distance, as in Light."""

    colour: NDArray[np.float64]
    falloff: int = 0
    smoothing: float = 0.0
    profile: tuple[tuple[float, ...], ...] = ()
    gobo: NDArray[np.float32] | None = None  # factors in each direction, see gobo.py

    @property
    def varies(self) -> bool:
        return bool(self.falloff or self.smoothing or self.profile)


def strength_of(
    obj: bpy.types.Object,
    matrix: NDArray[np.float64],
    record: NDArray[np.float64],
    owner: str,
    notes: Notes,
) -> Strength:
    """Return colour times strength of the Emission node of a light that `matrix` places; `record`
    (6, 4): of its object, as of Scene.objects."""
    light = obj.data
    graph = graph_of(light, owner, notes)
    graph.readers = readers_of(record, (obj, light))
    node, _, scope = graph.surface("OUTPUT_LIGHT")
    if node is None:
        return Strength(np.zeros(3))
    if node.type != "EMISSION":
        notes.approximated(owner, "Nodes", "no plain Emission: its own colour is used")
        return Strength(np.ones(3))
    strength, colour = node.inputs["Strength"], node.inputs["Color"]
    gobos = [_gobo(graph, light, matrix, socket, scope) for socket in (strength, colour)]
    found = Strength(np.ones(3)) if gobos[0] is not None else _strength(graph, strength, scope)
    factor = np.ones(3) if gobos[1] is not None else np.array(colour_of(graph, colour, scope))
    there = [gobo for gobo in gobos if gobo is not None]
    if len(there) == 2 and there[0].shape != there[1].shape:
        height, width, _ = there[1].shape
        there[0] = _resized(there[0], height, width)
    gobo = np.prod(there, axis=0, dtype=np.float32) if there else None
    if light.type == "SUN":  # which is as far from everywhere
        found = replace(found, falloff=0, smoothing=0.0)
    return replace(found, colour=found.colour * factor, gobo=gobo)


def _gobo(
    graph: Graph,
    light: bpy.types.Light,
    matrix: NDArray[np.float64],
    socket: bpy.types.NodeSocket,
    scope: Scope,
) -> NDArray[np.float32] | None:
    try:
        found = colours_of(light, matrix, socket, scope, graph.tell_absent)
    except Unsuited as reason:
        detail = f"one value stands for all directions and places: {reason}"
        graph.notes.approximated(graph.owner, f"Nodes of {socket.name}", detail)
        return None
    if found is not None:
        height, width = found.shape[:2]
        what = "places" if light.type == "AREA" else "directions"
        detail = f"an image of {width} x {height} {what} stands for them"
        graph.notes.approximated(graph.owner, f"Nodes of {socket.name}", detail)
    return found


def _resized(pixels: NDArray[np.float32], height: int, width: int) -> NDArray[np.float32]:
    """The nearest of each pixel."""
    rows, columns = (
        (np.arange(count) * of // count)
        for count, of in ((height, pixels.shape[0]), (width, pixels.shape[1]))
    )
    return pixels[rows][:, columns]


def _strength(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope) -> Strength:
    node, end, inner = source(socket, scope)
    if node is not None and node.type == "LIGHT_FALLOFF":
        found = _strength(graph, node.inputs["Strength"], inner)
        smoothing = value_of(graph, node.inputs["Smooth"], inner)
        return replace(found, falloff=FALLOFFS[end.name], smoothing=max(0.0, smoothing))
    if node is not None and node.type == "TEX_IES":
        found = _strength(graph, node.inputs["Strength"], inner)
        if node.inputs["Vector"].is_linked:
            graph.notes.approximated(graph.owner, "IES Vector", "the light's own direction is used")
        ies = read_ies(_text(node))
        if ies is None:
            detail = f"no IES file that can be read: {UNREADABLE:g} everywhere, as in Cycles"
            graph.notes.approximated(graph.owner, f"IES Texture '{node.name}'", detail)
            return replace(found, colour=found.colour * UNREADABLE)
        return replace(found, profile=ies.profile())
    if node is not None and node.type == "MATH" and node.operation == "MULTIPLY":
        first, second = (_strength(graph, node.inputs[index], inner) for index in (0, 1))
        if not (first.varies and second.varies):
            varying, constant = (first, second) if first.varies else (second, first)
            return replace(varying, colour=varying.colour * constant.colour)
    return Strength(np.full(3, value_of(graph, socket, scope)))


def _text(node: bpy.types.Node) -> str:
    """What an IES Texture's file says; nothing if it is not there."""
    if node.mode == "INTERNAL":
        return str(node.ies.as_string()) if node.ies else ""
    library = node.id_data.library
    path = Path(bpy.path.abspath(node.filepath, library=library))
    try:
        return path.read_text(encoding="latin-1")
    except OSError:
        return ""
