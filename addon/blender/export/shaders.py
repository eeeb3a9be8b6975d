# SPDX-License-Identifier: GPL-3.0-or-later
"""Read shader nodes as diffuse and specular lobes.

A shader is read at normal incidence, as the renderer's k_d and k_s do not depend on the angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import MIRROR
from .nodes import Graph, Scope, colour_of, linked, normal_reflectance, source, value_of

RGB = NDArray[np.float64]
# A lobe narrower than this is beyond float32 cosines on the GPU; roughness 0.038.
SHARPEST_EXPONENT = 1e6
# Fac sockets that Blender draws with a slider from 0 to 1 can still be fed anything.
UNIT = (0.0, 1.0)


@dataclass(frozen=True)
class Lobes:
    """What a shader reflects: k_d, and k_s with an exponent for each specular lobe."""

    diffuse: RGB
    specular: tuple[tuple[RGB, float], ...] = ()

    def scaled(self, weight: float) -> Lobes:
        specular = tuple((weight * k_s, exponent) for k_s, exponent in self.specular)
        return Lobes(weight * self.diffuse, specular)

    def plus(self, other: Lobes) -> Lobes:
        return Lobes(self.diffuse + other.diffuse, self.specular + other.specular)


BLACK = Lobes(np.zeros(3))
# A shader that lets light pass straight through reflects nothing and hides nothing.
CLEAR = None


def read_shader(graph: Graph, node: bpy.types.Node | None, scope: Scope) -> Lobes | None:
    """Return the lobes of the shader that ends in `node`; CLEAR if it is no surface at all."""
    if node is None:
        return BLACK
    reader = READERS.get(node.type)
    if reader is None:
        graph.notes.ignored(graph.owner, f"{node.bl_label} '{node.name}'", "reflects nothing")
        return BLACK
    return reader(graph, node, scope)


def _diffuse(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    if value_of(graph, node.inputs["Roughness"], scope) > 0.0:
        graph.notes.approximated(graph.owner, "Diffuse roughness", "rendered as Lambertian")
    _note_normal(graph, node)
    return Lobes(_colour(graph, node, "Color", scope))


def _glossy(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    _note_normal(graph, node)
    if node.inputs.get("Anisotropy") and value_of(graph, node.inputs["Anisotropy"], scope):
        graph.notes.approximated(graph.owner, "Anisotropy", "its reflections are round")
    exponent = _exponent(graph, node, scope)
    return Lobes(np.zeros(3), ((_colour(graph, node, "Color", scope), exponent),))


def _metallic(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    _note_normal(graph, node)
    graph.notes.approximated(graph.owner, "Metallic BSDF", "its colour does not change to the edge")
    colour = _colour(graph, node, "Base Color", scope)
    return Lobes(np.zeros(3), ((colour, _exponent(graph, node, scope)),))


def _principled(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    """Metallic share m: k_s = m * base; the rest: a reflecting layer F0 over (1 - F0) * base."""

    def number(name: str, default: float = 0.0) -> float:
        socket = node.inputs.get(name)
        return default if socket is None else value_of(graph, socket, scope)

    base = _colour(graph, node, "Base Color", scope)
    metallic = min(max(number("Metallic"), 0.0), 1.0)
    level = 2.0 * number("Specular IOR Level", 0.5)
    layer = min(1.0, normal_reflectance(number("IOR", 1.5)) * level)
    tint = _colour(graph, node, "Specular Tint", scope) if layer and metallic < 1.0 else np.ones(3)
    transmission = min(max(number("Transmission Weight"), 0.0), 1.0)
    _note_principled(graph, node, number, metallic)
    notes, owner = graph.notes, graph.owner
    if transmission and metallic < 1.0:
        notes.approximated(owner, "Transmission", "nothing is refracted: that light is absorbed")
    k_s = metallic * base + (1.0 - metallic) * layer * tint
    k_d = (1.0 - metallic) * (1.0 - transmission) * (1.0 - np.clip(layer * tint, *UNIT)) * base
    if not k_s.any():
        return Lobes(k_d)
    notes.approximated(owner, "Principled reflection", "its strength is that seen head-on")
    return Lobes(k_d, ((k_s, _exponent(graph, node, scope)),))


def _note_principled(
    graph: Graph, node: bpy.types.Node, number: Callable[..., float], metallic: float
) -> None:
    notes, owner = graph.notes, graph.owner
    if number("Alpha", 1.0) < 1.0 or linked(node, "Alpha"):
        notes.ignored(owner, "Alpha", "rendered opaque")
    if metallic < 1.0:
        if number("Subsurface Weight") > 0.0:
            notes.approximated(owner, "Subsurface", "rendered as diffuse")
        if number("Diffuse Roughness") > 0.0:
            notes.approximated(owner, "Diffuse roughness", "rendered as Lambertian")
    for name in ("Coat Weight", "Sheen Weight", "Thin Film Thickness"):
        if number(name) > 0.0:
            notes.ignored(owner, name.rsplit(" ", 1)[0], "left out")
    if number("Anisotropic"):
        notes.approximated(owner, "Anisotropic", "its reflections are round")
    strength = number("Emission Strength")
    glow = node.inputs.get("Emission Color")
    if strength and glow and (glow.is_linked or any(glow.default_value[:3])):
        notes.ignored(owner, "Emission", "it neither glows nor lights anything")
    _note_normal(graph, node)
    if linked(node, "Coat Normal"):
        notes.ignored(owner, "Coat Normal")


def _glass(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    """A dielectric's mirror part; what it would refract is absorbed."""
    graph.notes.approximated(
        graph.owner, f"{node.bl_label}", "nothing is refracted: only its reflection is rendered"
    )
    f0 = normal_reflectance(value_of(graph, node.inputs["IOR"], scope))
    k_s = f0 * _colour(graph, node, "Color", scope)
    return Lobes(np.zeros(3), ((k_s, _exponent(graph, node, scope)),))


def _as_diffuse(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    """Scattering of other kinds, as a diffuse surface of the same colour."""
    graph.notes.approximated(graph.owner, f"{node.bl_label}", "rendered as diffuse")
    return Lobes(_colour(graph, node, "Color", scope))


def _emission(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes:
    graph.notes.ignored(
        graph.owner, f"Emission '{node.name}'", "it neither glows nor lights anything"
    )
    return BLACK


def _transparent(graph: Graph, node: bpy.types.Node, scope: Scope) -> None:
    if not np.array_equal(_colour(graph, node, "Color", scope), np.ones(3)):
        graph.notes.approximated(graph.owner, "Transparent colour", "nothing is filtered")
    return CLEAR


def _mix(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes | None:
    factor = min(max(value_of(graph, node.inputs[0], scope), 0.0), 1.0)
    first = _input_shader(graph, node, 1, scope) if factor < 1.0 else BLACK
    second = _input_shader(graph, node, 2, scope) if factor > 0.0 else BLACK
    if factor in UNIT:
        return first if factor == 0.0 else second
    if first is CLEAR and second is CLEAR:
        return CLEAR
    if first is CLEAR or second is CLEAR:
        graph.notes.approximated(
            graph.owner, "Partly transparent", f"'{node.name}' is rendered opaque"
        )
        return second if first is CLEAR else first
    return first.scaled(1.0 - factor).plus(second.scaled(factor))


def _add(graph: Graph, node: bpy.types.Node, scope: Scope) -> Lobes | None:
    first = _input_shader(graph, node, 0, scope)
    second = _input_shader(graph, node, 1, scope)
    if first is CLEAR or second is CLEAR:
        if first is not second:
            graph.notes.approximated(
                graph.owner, "Partly transparent", f"'{node.name}' is rendered opaque"
            )
        return second if first is CLEAR else first
    return first.plus(second)


def _input_shader(graph: Graph, node: bpy.types.Node, index: int, scope: Scope) -> Lobes | None:
    shader, _, inner = source(node.inputs[index], scope)
    return read_shader(graph, shader, inner)


def _colour(graph: Graph, node: bpy.types.Node, name: str, scope: Scope) -> RGB:
    socket = node.inputs.get(name)
    return np.zeros(3) if socket is None else np.array(colour_of(graph, socket, scope))


def _exponent(graph: Graph, node: bpy.types.Node, scope: Scope) -> float:
    """Return the Phong exponent n = 2 / alpha^2 - 2 with alpha = roughness^2."""
    socket = node.inputs.get("Roughness")
    roughness = 0.0 if socket is None else abs(value_of(graph, socket, scope))
    if roughness == 0.0:
        return MIRROR
    exponent = max(0.0, 2.0 / roughness**4 - 2.0) if roughness > 1e-6 else math.inf
    if exponent > SHARPEST_EXPONENT:
        graph.notes.approximated(graph.owner, f"Roughness {roughness:.4g}", "rendered as a mirror")
        return MIRROR
    graph.notes.approximated(
        graph.owner,
        f"Roughness {roughness:.4g}",
        f"a Phong lobe of exponent {exponent:.4g} stands for Cycles' microfacets",
    )
    return exponent


def _note_normal(graph: Graph, node: bpy.types.Node) -> None:
    if linked(node, "Normal"):
        graph.notes.ignored(graph.owner, "Normal or bump map", "the mesh's own normals are used")


READERS: dict[str, Callable[[Graph, bpy.types.Node, Scope], Lobes | None]] = {
    "BSDF_DIFFUSE": _diffuse,
    "BSDF_GLOSSY": _glossy,
    "BSDF_METALLIC": _metallic,
    "BSDF_PRINCIPLED": _principled,
    "BSDF_GLASS": _glass,
    "SUBSURFACE_SCATTERING": _as_diffuse,
    "BSDF_TOON": _as_diffuse,
    "BSDF_SHEEN": _as_diffuse,
    "BSDF_TRANSLUCENT": _as_diffuse,
    "BSDF_TRANSPARENT": _transparent,
    "EMISSION": _emission,
    "MIX_SHADER": _mix,
    "ADD_SHADER": _add,
}
