# SPDX-License-Identifier: GPL-3.0-or-later
"""What is inside a mesh, or everywhere: media."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ....photon.scene import COEFFICIENTS, NO_MEDIUM, Medium, triple
from ....photon.scene.media import MOST_ANISOTROPY
from ..graph import Graph
from ..links import Scope, is_given, source
from ..nodes.spectra import colour_of
from ..own_program import own_program
from ..programs import ZERO, Program, Value, math
from .emission import radiance

# What stands for other phase functions: Henyey & Greenstein's of this anisotropy; or, of Draine's
# and Fournier & Forand's, of the same mean cosine, or as much that goes back.
PHASES = {"RAYLEIGH": 0.0, "MIE": 0.85}
# The constant of Stefan and Boltzmann over pi, times 1e-6, as Cycles has it.
STEFAN = 5.670373e-14 / np.pi
MIXED = ("MIX_SHADER", "ADD_SHADER")


@dataclass
class _Parts:
    """Of what several shaders make together, as Medium has it; `scatterers`: of each what it
    scatters, and its anisotropy."""

    absorption: Value = ZERO
    scattering: Value = ZERO
    emission: Value = ZERO
    scatterers: tuple[tuple[Value, float], ...] = ()

    def plus(self, other: _Parts, own: Value, its: Value) -> _Parts:
        """Both, so much of each."""
        scatterers = [(own * value, g) for value, g in self.scatterers]
        scatterers += [(its * value, g) for value, g in other.scatterers]
        return _Parts(
            own * self.absorption + its * other.absorption,
            own * self.scattering + its * other.scattering,
            own * self.emission + its * other.emission,
            tuple(scatterers),
        )

    def anisotropy(self, graph: Graph) -> float:
        """One for all: the mean by what each scatters, or of all alike where that differs from
        place to place."""
        there = [(value, g) for value, g in self.scatterers if value.may_exceed(0.0)]
        if len({g for _, g in there}) > 1:
            what = "what several shaders scatter has one in the mean"
            graph.notes.approximated(graph.owner, "Anisotropy", what)
        differ = not all(value.is_constant for value, _ in there)
        weights = [1.0 if differ else float(value.colour.sum()) for value, _ in there]
        mean = np.average([g for _, g in there], weights=weights) if there else 0.0
        return float(np.clip(mean, -MOST_ANISOTROPY, MOST_ANISOTROPY))


NOTHING = _Parts()


def medium_of(graph: Graph, output: bpy.types.Node, where: str) -> Medium:
    """The medium of an output's Volume, as Cycles has it; `where`: as Graph.volume. None of what is
    no volume, which is noted."""
    if not is_given(output.inputs["Volume"], ()):
        return NO_MEDIUM
    graph = replace(graph, program=Program(), displaced=None, volume=where, _known={}, _reading=[])
    try:
        found = _read(graph, output.inputs["Volume"], ())
    except _Unknown as unknown:
        graph.notes.ignored(graph.owner, "Volume", f"{unknown}: none")
        return NO_MEDIUM
    if where == "world" and found.emission.may_exceed(0.0):
        graph.notes.ignored(graph.owner, "Emission of a volume", "the world's emits nothing")
        found = replace(found, emission=ZERO)
    values = {name: getattr(found, name) for name in COEFFICIENTS}
    results = {name: value.result for name, value in values.items() if value.result is not None}
    told = own_program(graph, "Volume", results)
    if told is None:
        return NO_MEDIUM
    program, moved = told
    if moved:
        graph.notes.approximated(graph.owner, "Volume", "its nodes are asked at points of a grid")
    absorption, scattering, emission = (
        moved.get(name) or triple(_finite(value).colour) for name, value in values.items()
    )
    return Medium(absorption, scattering, found.anisotropy(graph), emission, program)


class _Unknown(Exception):
    """Why a volume is not rendered."""


def _read(graph: Graph, socket: bpy.types.NodeSocket, outside: Scope) -> _Parts:
    node, _, scope = source(socket, outside)
    if node is None:
        return NOTHING
    if node.type in MIXED:
        first, second = (_read(graph, socket, scope) for socket in node.inputs[-2:])
        if node.type == "ADD_SHADER":
            return first.plus(second, Value.of(1.0), Value.of(1.0))
        factor = graph.value(node.inputs[0], scope).clamp()
        return first.plus(second, 1.0 - factor, factor)
    if node.type == "VOLUME_ABSORPTION":
        density, colour = _density(graph, node, scope), _colour(graph, node, "Color", scope)
        return _Parts(absorption=density * math("MAXIMUM", 1.0 - colour, 0.0))
    if node.type == "VOLUME_SCATTER":
        density, colour = _density(graph, node, scope), _colour(graph, node, "Color", scope)
        return _scattering(density * colour, _anisotropy(graph, node, scope))
    if node.type == "PRINCIPLED_VOLUME":
        return _principled(graph, node, scope)
    if node.type == "VOLUME_COEFFICIENTS":
        return _coefficients(graph, node, scope)
    if node.type == "EMISSION":
        return _Parts(emission=_finite(radiance(graph, node, scope, "Color", "Strength")))
    raise _Unknown(f"{node.bl_label} is no volume that is rendered")


def _principled(graph: Graph, node: bpy.types.Node, scope: Scope) -> _Parts:
    density, colour = _density(graph, node, scope), _colour(graph, node, "Color", scope)
    kept = math("SQRT", _colour(graph, node, "Absorption Color", scope))
    absorbed = math("MAXIMUM", 1.0 - colour, 0.0) * math("MAXIMUM", 1.0 - kept, 0.0)
    emitted = _finite(radiance(graph, node, scope, "Emission Color", "Emission Strength"))
    emitted = emitted + _of_black_body(graph, node, scope)
    scattering = _scattering(density * colour, _anisotropy(graph, node, scope))
    return replace(scattering, absorption=density * absorbed, emission=emitted)


def _of_black_body(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    """What Principled Volume emits by its temperature [W/(m^3 sr)]: STEFAN of it and its fourth
    power, as it is mixed."""
    much = _finite(graph.input(node, "Blackbody Intensity", scope, 0.0))
    if not much.may_exceed(0.0):
        return ZERO
    kelvin = math("MAXIMUM", _finite(graph.input(node, "Temperature", scope, 1000.0)), 0.0)
    fourth = (kelvin * kelvin) * (kelvin * kelvin)
    brightness = STEFAN * (1.0 + math("MAXIMUM", much, 0.0) * (fourth - 1.0))
    tint = _colour(graph, node, "Blackbody Tint", scope)
    return tint * math("MAXIMUM", brightness, 0.0) * colour_of(graph, kelvin)


def _coefficients(graph: Graph, node: bpy.types.Node, scope: Scope) -> _Parts:
    absorbed = _colour(graph, node, "Absorption Coefficients", scope)
    scattered = _colour(graph, node, "Scatter Coefficients", scope)
    emitted = _colour(graph, node, "Emission Coefficients", scope)
    scattering = _scattering(scattered, _anisotropy(graph, node, scope))
    return replace(scattering, absorption=absorbed, emission=emitted)


def _scattering(scattered: Value, anisotropy: float) -> _Parts:
    return _Parts(scattering=scattered, scatterers=((scattered, anisotropy),))


def _anisotropy(graph: Graph, node: bpy.types.Node, scope: Scope) -> float:
    phase = getattr(node, "phase", "HENYEY_GREENSTEIN")
    if phase != "HENYEY_GREENSTEIN":
        what = "Henyey-Greenstein's phase function stands for it"
        graph.notes.approximated(graph.owner, f"Phase {phase.title().replace('_', '-')}", what)
    if phase in PHASES:
        return PHASES[phase]
    names = {"FOURNIER_FORAND": ("Backscatter",), "DRAINE": ("Anisotropy", "Alpha")}
    found = [
        _finite(graph.input(node, name, scope, 0.0)) for name in names.get(phase, ("Anisotropy",))
    ]
    if not all(value.is_constant for value in found):
        what = "it differs from place to place: 0 is used"
        graph.notes.approximated(graph.owner, "Anisotropy", what)
        return 0.0
    first, *others = (value.number for value in found)
    if phase == "FOURNIER_FORAND":
        return _anisotropy_of_backscatter(first)
    return _mean_cosine(first, *others)


def _mean_cosine(g: float, alpha: float = 0.0) -> float:
    """Of Draine's phase function (2003)."""
    return g * (1.0 + alpha * (3.0 + 2.0 * g * g) / 5.0) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0)


def _anisotropy_of_backscatter(share: float) -> float:
    """Of Henyey & Greenstein's that sends this share back."""
    low, high = 1e-6, MOST_ANISOTROPY
    for _ in range(40):
        g = (low + high) / 2.0
        back = (1.0 - g) / (2.0 * g) * ((1.0 + g) / np.sqrt(1.0 + g * g) - 1.0)
        low, high = (g, high) if back > share else (low, g)
    return low


def _density(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    return math("MAXIMUM", _finite(graph.input(node, "Density", scope, 1.0)), 0.0)


def _colour(graph: Graph, node: bpy.types.Node, name: str, scope: Scope) -> Value:
    return math("MAXIMUM", _finite(graph.input(node, name, scope, 0.0)), 0.0)


def _finite(value: Value) -> Value:
    """0 for a constant that is none."""
    if value.constant is None:
        return value
    return Value.of(np.nan_to_num(value.constant, posinf=0.0, neginf=0.0))
