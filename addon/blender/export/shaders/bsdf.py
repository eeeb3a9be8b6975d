# SPDX-License-Identifier: GPL-3.0-or-later
"""What a shader reflects, and what its readers share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

import bpy
import numpy as np
from numpy.typing import NDArray

from ....photon.scene import RGB, Lobe, phong
from ..nodes import Graph, Scope, colour_of, linked, value_of
from ..tangents import Tangent

Colour = NDArray[np.float64]
# A Phong lobe narrower than this is beyond float32 cosines on the GPU; roughness 0.038.
SHARPEST_EXPONENT = 1e6
# alpha_x alpha_y up to which Cycles' microfacets are a perfect mirror; roughness 0.0038.
SMOOTH = 2e-10
# An index this close to 1 reflects nothing.
NO_INTERFACE = 1e-4
# Fac sockets that Blender draws with a slider from 0 to 1 can still be fed anything.
UNIT = (0.0, 1.0)


class SpecularModel(Enum):
    """What stands for Cycles' glossy closures: themselves, or the lobes of the paper."""

    GGX = "GGX"
    PHONG = "PHONG"


@dataclass(frozen=True)
class Bsdf:
    """The albedo of a diffuse lobe that nothing covers, other lobes, and what it emits."""

    diffuse: Colour
    lobes: tuple[Lobe, ...] = ()
    tangent: Tangent | None = None  # of those that are anisotropic
    holdout: float = 0.0  # the share through which the eye sees nothing
    emission: Colour = field(default_factory=lambda: np.zeros(3))  # radiance [W/(m^2 sr)]

    def scaled(self, factor: float) -> Bsdf:
        """As much of it as a Mix Shader takes."""
        lobes = tuple(_scaled(lobe, factor) for lobe in self.lobes)
        return Bsdf(
            factor * self.diffuse,
            lobes,
            self.tangent,
            factor * self.holdout,
            factor * self.emission,
        )

    def plus(self, other: Bsdf) -> Bsdf:
        """Both; lobes of one shape become one."""
        lobes = list(self.lobes)
        for lobe in other.lobes:
            at = next((i for i, own in enumerate(lobes) if _joins(own, lobe)), None)
            if at is None:
                lobes.append(lobe)
            else:
                lobes[at] = _joined(lobes[at], lobe)
        return Bsdf(
            self.diffuse + other.diffuse,
            tuple(lobes),
            self.tangent or other.tangent,
            self.holdout + other.holdout,
            self.emission + other.emission,
        )


BLACK = Bsdf(np.zeros(3))
# A shader that lets light pass straight through reflects nothing and hides nothing.
CLEAR = None


# Kinds whose colour times weight is all that there is to them.
_PLAIN = ("mirror", "phong")


def _scaled(lobe: Lobe, factor: float) -> Lobe:
    if lobe.kind in _PLAIN:
        return replace(lobe, colour=triple(factor * np.array(lobe.colour)))
    covered = triple(factor * np.array(lobe.covered))
    return replace(lobe, weight=factor * lobe.weight, covered=covered)


def _joins(one: Lobe, other: Lobe) -> bool:
    same = (one.kind, one.parameters) == (other.kind, other.parameters)
    return same and (one.kind in _PLAIN or one.colour == other.colour)


def _joined(one: Lobe, other: Lobe) -> Lobe:
    if one.kind in _PLAIN:
        return replace(one, colour=triple(np.add(one.colour, other.colour)))
    covered = triple(np.add(one.covered, other.covered))
    return replace(one, weight=one.weight + other.weight, covered=covered)


def triple(values: Colour) -> RGB:
    """Three numbers as a value of the scene's."""
    red, green, blue = (float(value) for value in values)
    return red, green, blue


def colour(graph: Graph, node: bpy.types.Node, name: str, scope: Scope) -> Colour:
    """The colour of an input, black if there is no such input."""
    socket = node.inputs.get(name)
    return np.zeros(3) if socket is None else np.array(colour_of(graph, socket, scope))


def number(
    graph: Graph, node: bpy.types.Node, name: str, scope: Scope, default: float = 0.0
) -> float:
    """The number of an input, `default` if there is no such input."""
    socket = node.inputs.get(name)
    return default if socket is None else value_of(graph, socket, scope)


def note_normal(graph: Graph, node: bpy.types.Node) -> None:
    """Say that a normal or bump map is not used."""
    if linked(node, "Normal"):
        graph.notes.ignored(graph.owner, "Normal or bump map", "the mesh's own normals are used")


def note_anisotropy(graph: Graph, node: bpy.types.Node, scope: Scope) -> None:
    """Say that reflections are not stretched."""
    for name in ("Anisotropy", "Anisotropic"):
        if number(graph, node, name, scope):
            graph.notes.approximated(graph.owner, name, "its reflections are round")


def as_diffuse(graph: Graph, node: bpy.types.Node, scope: Scope) -> Bsdf:
    """Scattering of other kinds, as a diffuse surface of the same colour."""
    graph.notes.approximated(graph.owner, f"{node.bl_label}", "rendered as diffuse")
    return Bsdf(colour(graph, node, "Color", scope))


def roughness_of(graph: Graph, node: bpy.types.Node, scope: Scope) -> float:
    """A node's roughness, in [0, 1]."""
    return min(abs(number(graph, node, "Roughness", scope)), 1.0)


def phong_of(graph: Graph, node: bpy.types.Node, k_s: Colour, scope: Scope) -> Lobe:
    """The paper's lobe of a node's roughness: exponent n = 2 / alpha^2 - 2, alpha = roughness^2."""
    roughness = abs(number(graph, node, "Roughness", scope))
    if roughness == 0.0:
        return Lobe("mirror", triple(k_s))
    exponent = max(0.0, 2.0 / roughness**4 - 2.0) if roughness > 1e-6 else math.inf
    what = f"Roughness {roughness:.4g}"
    if exponent > SHARPEST_EXPONENT:
        graph.notes.approximated(graph.owner, what, "rendered as a mirror")
        return Lobe("mirror", triple(k_s))
    stands = f"a Phong lobe of exponent {exponent:.4g} stands for Cycles' microfacets"
    graph.notes.approximated(graph.owner, what, stands)
    return phong(triple(k_s), exponent)


def is_smooth(parameters: Mapping[str, float]) -> bool:
    """Whether these are a perfect mirror's."""
    return parameters["alpha_x"] * parameters["alpha_y"] <= SMOOTH


def clipped(values: Colour) -> Colour:
    """Colours as Cycles clamps reflectances."""
    return np.clip(values, *UNIT)
