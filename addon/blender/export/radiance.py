# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's nodes as a sum: of colours and of images, each times a factor for each of those that
may find a light (Light Path nodes tell them apart)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import FOUND_BY
from .environment import EnvironmentMap, read_environment_map
from .graph import MAGENTA, Graph, colour_of, missing
from .links import Scope, source
from .made_nodes import made
from .nodes.texture_vector import note_mapping
from .programs import Value
from .report import Notes
from .sky import Disc, has_disc, read_sky
from .world_coordinates import placed_by
from .world_nodes import Unsuited, evaluate

Factor = NDArray[np.float64]  # (8, 3), of each of FOUND_BY and each channel
ONE: Factor = np.ones((len(FOUND_BY), 3))
# What Light Path tells each of FOUND_BY; other outputs are 0 to all. In Cycles a shadow ray is none
# of these, whatever surface sent it: what it shows then depends on how it draws its samples.
LIGHT_PATH = {
    "Is Camera Ray": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "Is Diffuse Ray": (0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
    "Is Glossy Ray": (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0),
    "Is Reflection Ray": (0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    "Is Singular Ray": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0),
    "Is Transmission Ray": (0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0),
    # Of what is behind all it is one more than the bounces.
    "Ray Depth": (1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0),
    "Is Volume Scatter Ray": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
}
NOBODY = (0.0,) * len(FOUND_BY)
SAME_IN_CYCLES = {"Is Camera Ray", "Is Glossy Ray"}
EVEN = 1e-6  # relative: an image of such differences is a colour


@dataclass
class Sum:
    """What a world radiates."""

    colour: Factor = field(default_factory=lambda: np.zeros_like(ONE))
    # Each with a name.
    images: list[tuple[str, EnvironmentMap, Factor]] = field(default_factory=list)
    discs: list[tuple[Disc, Factor]] = field(default_factory=list)

    def add_image(self, name: str, environment: EnvironmentMap, factor: Factor) -> None:
        first = environment.pixels[0, 0]
        if all(np.abs(row - first).max() <= EVEN * first.max() for row in environment.pixels):
            self.colour += factor * first.astype(np.float64)
        else:
            self.images.append((name, environment, factor))


class _Uneven(Exception):
    """A number differs from direction to direction."""


def radiance(
    graph: Graph, node: bpy.types.Node | None, output: bpy.types.NodeSocket | None, scope: Scope
) -> Sum:
    """The sum of what a shader radiates; what is no such sum is noted."""
    total = Sum()
    if node is not None:
        _shader(graph, node, output, scope, ONE, total)
    return total


def _shader(
    graph: Graph,
    node: bpy.types.Node | None,
    output: bpy.types.NodeSocket,
    scope: Scope,
    factor: Factor,
    total: Sum,
) -> None:
    if node is None or not factor.any():
        return
    try:
        if node.type in ("BACKGROUND", "EMISSION"):
            strength = _number(graph, node.inputs["Strength"], scope)
            _colour(graph, node.inputs["Color"], scope, factor * strength, total)
            return
        if node.type in ("MIX_SHADER", "ADD_SHADER"):
            parts = [factor, factor]
            if node.type == "MIX_SHADER":
                share = _number(graph, node.inputs[0], scope).clip(0.0, 1.0)
                parts = [factor * (1.0 - share), factor * share]
            if (node, scope) in graph.shaders:
                what = "its links go in a circle: black"
                graph.notes.approximated(graph.owner, f"'{node.name}'", what)
                return
            graph.shaders.append((node, scope))
            for socket, part in zip(node.inputs[-2:], parts, strict=True):
                feeding, end, inner = source(socket, scope)
                _shader(graph, feeding, end, inner, part, total)
            graph.shaders.pop()
            return
    except _Uneven:
        pass
    try:
        _evaluate(graph, node, output, scope, factor, total)
    except Unsuited as reason:
        label = f"{node.bl_label} '{node.name}'"
        graph.notes.ignored(graph.owner, label, f"black is used: {reason}")


def _colour(
    graph: Graph, socket: bpy.types.NodeSocket, scope: Scope, factor: Factor, total: Sum
) -> None:
    node, end, inner = source(socket, scope)
    if not factor.any():
        return
    if node is None or node.type in ("RGB", "VALUE"):
        total.colour += factor * _constant(end)
        return
    try:
        try:
            if node.type == "TEX_ENVIRONMENT" and end.name == "Color":
                _environment(graph, node, end, inner, factor, total)
            elif node.type == "TEX_SKY" and has_disc(node):
                _sky(graph, node, end, inner, factor, total)
            elif _is_mix(node):
                _mix(graph, node, inner, factor, total)
            else:
                total.colour += factor * _number(graph, socket, scope)
        except _Uneven:
            _evaluate(graph, node, end, inner, factor, total)
    except Unsuited as reason:
        graph.notes.ignored(graph.owner, f"{node.bl_label} '{node.name}'", str(reason))
        total.colour += factor * colour_of(graph, socket, scope)


def _environment(
    graph: Graph,
    node: bpy.types.Node,
    end: bpy.types.NodeSocket,
    scope: Scope,
    factor: Factor,
    total: Sum,
) -> None:
    if missing(node):
        graph.tell_absent(node)
        total.colour += factor * MAGENTA
        return
    note_mapping(node, graph.owner, graph.notes)
    environment = read_environment_map(node, scope)
    if environment is None:
        _evaluate(graph, node, end, scope, factor, total)
        return
    if environment.is_finer:
        height, width = environment.pixels.shape[:2]
        how = f"{node.interpolation.lower()}: an image of {width} x {height} pixels stands for it"
        graph.notes.approximated(graph.owner, f"Interpolation of '{node.name}'", how)
    if environment.downsampling > 1:
        block = f"{environment.downsampling} x {environment.downsampling}"
        width, height = node.image.size
        read = 4e-9 * width * height * node.image.channels
        detail = (
            f"{block} of its {width}x{height} pixels become one, when Blender has read all, which "
            f"takes {read:.2g} GB, and as much for a copy: a smaller file starts sooner"
        )
        graph.notes.approximated(graph.owner, f"Image of '{node.name}'", detail)
    total.add_image(node.image.name, environment, factor)


def _sky(
    graph: Graph,
    node: bpy.types.Node,
    end: bpy.types.NodeSocket,
    scope: Scope,
    factor: Factor,
    total: Sum,
) -> None:
    environment, disc = read_sky(node, end, scope)
    height, width = environment.pixels.shape[:2]
    detail = f"an image of {width} x {height} pixels and an even disc stand for it"
    graph.notes.approximated(graph.owner, f"{node.bl_label} '{node.name}'", detail)
    total.add_image(node.name, environment, factor)
    if disc:
        total.discs.append((disc, factor))


def _mix(graph: Graph, node: bpy.types.Node, scope: Scope, factor: Factor, total: Sum) -> None:
    """Raises _Uneven before anything is added."""
    new = node.type == "MIX"
    first = 6 if new else 1  # of the sockets of colours, which other types' are before
    share = _number(graph, node.inputs[0], scope)
    if not new or node.clamp_factor:
        share = share.clip(0.0, 1.0)
    a, b = node.inputs[first], node.inputs[first + 1]
    if node.blend_type == "MIX":
        _colour(graph, a, scope, factor * (1.0 - share), total)
        _colour(graph, b, scope, factor * share, total)
    elif node.blend_type == "ADD":
        _colour(graph, a, scope, factor, total)
        _colour(graph, b, scope, factor * share, total)
    elif node.blend_type == "MULTIPLY":
        for one, other in ((a, b), (b, a)):
            feeding, end, _ = source(other, scope)
            if (feeding is None or feeding.type in ("RGB", "VALUE")) and (
                other == b or (share == 1.0).all()
            ):
                by = 1.0 - share + share * _constant(end)
                _colour(graph, one, scope, factor * by, total)
                return
        raise _Uneven
    else:
        raise _Uneven


def _is_mix(node: bpy.types.Node) -> bool:
    if node.type == "MIX":
        return bool(node.data_type == "RGBA" and not node.clamp_result)
    return bool(node.type == "MIX_RGB" and not node.use_clamp)


def _number(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope) -> Factor:
    """(8, 1) what an input gives each of FOUND_BY, of a colour (8, 3). Raises _Uneven."""
    found = [_told(graph, socket, scope, at) for at in range(len(FOUND_BY))]
    return np.array([value.colour[: 3 if socket.type == "RGBA" else 1] for value in found])


def _uneven(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """A texture: it need not be read to know that. Raises _Uneven."""
    raise _Uneven


def _told(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope, at: int) -> Value:
    """What an input gives one of FOUND_BY, where no direction makes a difference."""
    told: set[str] = set()

    def path(
        graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
    ) -> Value:
        told.add(output.name)
        return Value.of(_path_tells(output.name, at))

    own = Notes()
    uneven = {kind: _uneven for kind in graph.readers if kind.startswith("TEX_")}
    readers = {**graph.readers, **uneven, "LIGHT_PATH": path}
    one = Graph(graph.tree, graph.owner, own, readers, graph.averages, graph.context)
    found = one.value(socket, scope)
    if not found.is_constant or any(x.status != "exact" for x in own.finish().entries):
        raise _Uneven
    _note_paths(graph, told)
    return found


def _constant(end: bpy.types.NodeSocket) -> NDArray[np.float64]:
    """(3,), of a socket that nothing feeds."""
    value: Any = getattr(end, "default_value", 0.0)
    if isinstance(value, (int, float)):
        return np.full(3, float(value))
    return np.array(value[:3], np.float64)


def _evaluate(
    graph: Graph,
    node: bpy.types.Node,
    output: bpy.types.NodeSocket,
    scope: Scope,
    factor: Factor,
    total: Sum,
) -> None:
    """Add an image, or one for each of those that Light Path tells apart. Raises Unsuited before
    anything is added."""
    asked: set[str] = set()
    made_by_told: dict[tuple[float, ...], tuple[EnvironmentMap, Factor]] = {}
    for at in np.flatnonzero(factor.any(axis=1)):
        told = tuple(_path_tells(name, at) for name in sorted(asked))
        if told not in made_by_told:
            image = _image_found_by(graph, node, output, scope, at, asked)
            told = tuple(_path_tells(name, at) for name in sorted(asked))
            made_by_told[told] = image, np.zeros_like(ONE)
        made_by_told[told][1][at] = factor[at]
    for image, share in made_by_told.values():
        total.add_image(node.name, image, share)
    _note_paths(graph, asked)
    height, width = max(image.pixels.shape[:2] for image, _ in made_by_told.values())
    of_each = "" if len(made_by_told) == 1 else ", one for each that Light Path tells apart"
    detail = f"an image of {width} x {height} pixels stands for it{of_each}"
    graph.notes.approximated(graph.owner, f"{node.bl_label} '{node.name}'", detail)


def _image_found_by(
    graph: Graph,
    node: bpy.types.Node,
    output: bpy.types.NodeSocket,
    scope: Scope,
    at: int,
    asked: set[str],
) -> EnvironmentMap:
    """What nodes make of every direction for one of FOUND_BY; what they ask of Light Path is added
    to `asked`."""
    placed = placed_by(graph.context.camera)

    def stand_in(
        node: bpy.types.Node, output: bpy.types.NodeSocket | None
    ) -> list[dict[str, Any]] | None:
        if output is None or node.type != "LIGHT_PATH":
            return placed(node, output)
        asked.add(output.name)
        told = {0: _path_tells(output.name, at), 1: 0.0}
        return [made("ShaderNodeMath", values=told, operation="ADD")]

    def tell_negative() -> None:
        graph.notes.approximated(graph.owner, "Negative light", "0 is used")

    tell = graph.tell_absent
    pixels = evaluate(
        node, output, scope, stand_in=stand_in, tell=tell, tell_negative=tell_negative
    )
    return EnvironmentMap(pixels, np.eye(3))


def _path_tells(output: str, at: int) -> float:
    return LIGHT_PATH.get(output, NOBODY)[at]


def _note_paths(graph: Graph, asked: set[str]) -> None:
    for name in sorted(asked - SAME_IN_CYCLES):
        detail = "diffuse surfaces, lobes, what lets through, media and the camera are told apart"
        graph.notes.approximated(graph.owner, f"Light Path's {name}", detail)
