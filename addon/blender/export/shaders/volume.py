# SPDX-License-Identifier: GPL-3.0-or-later
"""What is inside a mesh, or everywhere: media that are the same from point to point. Others are
reported."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ....photon.scene import NO_MEDIUM, Medium
from ....photon.scene.media import MOST_ANISOTROPY
from ..graph import Graph
from ..links import Scope, is_given, source
from ..programs import Value
from ..triples import triple

# What stands for other phase functions: Henyey & Greenstein's of their own anisotropy, or of this.
PHASES = {"RAYLEIGH": 0.0, "MIE": 0.85, "FOURNIER_FORAND": 0.9}
MIXED = ("MIX_SHADER", "ADD_SHADER")


@dataclass
class _Parts:
    """Of what several shaders make together [1/m]; `turned`: scattering times its anisotropy;
    `anisotropies`: of each that scatters."""

    absorption: NDArray[np.float64]
    scattering: NDArray[np.float64]
    turned: NDArray[np.float64]
    anisotropies: frozenset[float] = frozenset()

    def plus(self, other: _Parts, own: float = 1.0, its: float = 1.0) -> _Parts:
        """Both, so much of each."""
        return _Parts(
            own * self.absorption + its * other.absorption,
            own * self.scattering + its * other.scattering,
            own * self.turned + its * other.turned,
            self.anisotropies | other.anisotropies,
        )


def medium_of(graph: Graph, output: bpy.types.Node) -> Medium:
    """The medium of an output's Volume, as Cycles has it; none of what differs from point to point
    or is no volume, which is noted."""
    if not is_given(output.inputs["Volume"], ()):
        return NO_MEDIUM
    try:
        found = _read(graph, output.inputs["Volume"], ())
    except _Unknown as unknown:
        graph.notes.ignored(graph.owner, "Volume", f"{unknown}: none")
        return NO_MEDIUM
    if len(found.anisotropies) > 1:
        what = "what several shaders scatter has one in the mean"
        graph.notes.approximated(graph.owner, "Anisotropy", what)
    scattered = found.scattering.sum()
    turned = found.turned.sum() / scattered if scattered > 0.0 else 0.0
    return Medium(
        triple(found.absorption),
        triple(found.scattering),
        float(np.clip(turned, -MOST_ANISOTROPY, MOST_ANISOTROPY)),
    )


class _Unknown(Exception):
    """Why a volume is not rendered."""


def _nothing() -> _Parts:
    return _absorbing(np.zeros(3))


def _read(graph: Graph, socket: bpy.types.NodeSocket, outside: Scope) -> _Parts:
    node, _, scope = source(socket, outside)
    if node is None:
        return _nothing()
    if node.type in MIXED:
        first, second = (_read(graph, socket, scope) for socket in node.inputs[-2:])
        if node.type == "ADD_SHADER":
            return first.plus(second)
        factor = float(np.clip(_constant(graph.value(node.inputs[0], scope))[0], 0.0, 1.0))
        return first.plus(second, 1.0 - factor, factor)
    if node.type == "VOLUME_ABSORPTION":
        density, colour = _density(graph, node, scope), _colour(graph, node, "Color", scope)
        return _absorbing(density * np.maximum(1.0 - colour, 0.0))
    if node.type == "VOLUME_SCATTER":
        density, colour = _density(graph, node, scope), _colour(graph, node, "Color", scope)
        return _scattering(density * colour, _anisotropy(graph, node, scope))
    if node.type == "PRINCIPLED_VOLUME":
        return _principled(graph, node, scope)
    if node.type == "VOLUME_COEFFICIENTS":
        return _coefficients(graph, node, scope)
    if node.type == "EMISSION":
        _note_emission(graph)
        return _nothing()
    raise _Unknown(f"{node.bl_label} is no volume that is rendered")


def _principled(graph: Graph, node: bpy.types.Node, scope: Scope) -> _Parts:
    density, colour = _density(graph, node, scope), _colour(graph, node, "Color", scope)
    kept = np.sqrt(_colour(graph, node, "Absorption Color", scope))
    absorbed = np.maximum(1.0 - colour, 0.0) * np.maximum(1.0 - kept, 0.0)
    emitted = graph.input(node, "Emission Strength", scope, 0.0)
    warm = graph.input(node, "Blackbody Intensity", scope, 0.0)
    if density > 0.0 and (emitted.may_exceed(0.0) or warm.may_exceed(0.0)):
        _note_emission(graph)
    scattering = _scattering(density * colour, _anisotropy(graph, node, scope))
    return scattering.plus(_absorbing(density * absorbed))


def _coefficients(graph: Graph, node: bpy.types.Node, scope: Scope) -> _Parts:
    absorbed = _colour(graph, node, "Absorption Coefficients", scope)
    scattered = _colour(graph, node, "Scatter Coefficients", scope)
    if _colour(graph, node, "Emission Coefficients", scope).any():
        _note_emission(graph)
    scattering = _scattering(scattered, _anisotropy(graph, node, scope))
    return scattering.plus(_absorbing(absorbed))


def _note_emission(graph: Graph) -> None:
    graph.notes.ignored(graph.owner, "Emission of a volume", "not rendered")


def _absorbing(absorbed: NDArray[np.float64]) -> _Parts:
    return _Parts(absorbed, *np.zeros((2, 3)))


def _scattering(scattered: NDArray[np.float64], anisotropy: float) -> _Parts:
    of_each = frozenset({anisotropy} if scattered.any() else ())
    return _Parts(np.zeros(3), scattered, anisotropy * scattered, of_each)


def _anisotropy(graph: Graph, node: bpy.types.Node, scope: Scope) -> float:
    phase = getattr(node, "phase", "HENYEY_GREENSTEIN")
    if phase != "HENYEY_GREENSTEIN":
        what = "Henyey-Greenstein's phase function stands for it"
        graph.notes.approximated(graph.owner, f"Phase {phase.title().replace('_', '-')}", what)
    if phase in PHASES:
        return PHASES[phase]
    return float(_constant(graph.input(node, "Anisotropy", scope, 0.0))[0])


def _density(graph: Graph, node: bpy.types.Node, scope: Scope) -> float:
    return max(float(_constant(graph.input(node, "Density", scope, 1.0))[0]), 0.0)


def _colour(graph: Graph, node: bpy.types.Node, name: str, scope: Scope) -> NDArray[np.float64]:
    return np.maximum(_constant(graph.input(node, name, scope, 0.0)), 0.0)


def _constant(value: Value) -> NDArray[np.float64]:
    """(3,); raises _Unknown if it differs from point to point."""
    if not value.is_constant:
        raise _Unknown("it differs from point to point")
    return np.nan_to_num(value.colour, posinf=0.0, neginf=0.0)
