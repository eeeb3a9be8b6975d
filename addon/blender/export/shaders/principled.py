# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled BSDF: metal, or a dielectric's microfacets over a diffuse base."""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np

from ....photon.scene import Lobe
from ..nodes import Graph, Scope, linked, normal_reflectance
from .bsdf import (
    NO_INTERFACE,
    Bsdf,
    Colour,
    SpecularModel,
    clipped,
    colour,
    note_anisotropy,
    note_normal,
    number,
    phong_of,
    triple,
)
from .emission import radiance
from .metallic import metal
from .microfacets import along, microfacets

MOST_F0 = 0.99  # beyond which the specular level raises no index any more
# What Cycles gives to objects without a material, Blender 5.0 on.
DEFAULT_BASE, DEFAULT_ROUGHNESS, DEFAULT_IOR = (0.8, 0.8, 0.8), 0.5, 1.5


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read metallic and dielectric shares; the rest is reported."""
    value = partial(_number, graph, node, scope)
    base = np.maximum(colour(graph, node, "Base Color", scope), 0.0)
    metallic = min(max(value("Metallic"), 0.0), 1.0)
    _note(graph, node, scope, metallic)
    glow = radiance(graph, node, scope, "Emission Color", "Emission Strength")
    found = Bsdf(np.zeros(3), emission=glow)
    if model is SpecularModel.PHONG:
        return found.plus(_as_phong(graph, node, scope, base, metallic))
    if metallic > 0.0:
        tint = colour(graph, node, "Specular Tint", scope)
        found = found.plus(metal(graph, node, scope, model, base, tint).scaled(metallic))
    if metallic < 1.0:
        found = found.plus(_dielectric(graph, node, scope, base).scaled(1.0 - metallic))
    return found


def default() -> Bsdf:
    """What Cycles gives to objects without a material."""
    alpha = DEFAULT_ROUGHNESS**2
    parameters = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0}
    return over_diffuse(
        np.array(DEFAULT_BASE), np.full(3, normal_reflectance(DEFAULT_IOR)), DEFAULT_IOR, parameters
    )


def over_diffuse(base: Colour, f0: Colour, ior: float, parameters: dict[str, float]) -> Bsdf:
    """A dielectric's lobe, of a reflectance head-on, over a diffuse albedo."""
    given = {**parameters, "ior": ior}
    return Bsdf(np.zeros(3), (Lobe("ggx_dielectric", triple(f0), given, covered=triple(base)),))


def _dielectric(graph: Graph, node: bpy.types.Node, scope: Scope, base: Colour) -> Bsdf:
    value = partial(_number, graph, node, scope)
    transmission = min(max(value("Transmission Weight"), 0.0), 1.0)
    under = (1.0 - transmission) * base
    f0, ior = level_of(value("IOR", 1.5), value("Specular IOR Level", 0.5))
    if abs(ior - 1.0) < NO_INTERFACE:
        return Bsdf(under)
    tint = np.maximum(colour(graph, node, "Specular Tint", scope), 0.0)
    parameters = microfacets(graph, node, scope)
    return along(graph, node, scope, over_diffuse(under, clipped(f0 * tint), ior, parameters))


def level_of(ior: float, level: float) -> tuple[float, float]:
    """A dielectric's reflectance head-on, and the index whose curve leads on from there.

    As Cycles has it: a Specular IOR Level other than 0.5 changes both.
    """
    ior = max(ior, 1e-5)
    f0 = normal_reflectance(ior)
    if level == 0.5:
        return f0, ior
    f0 *= 2.0 * max(level, 0.0)
    root = min(f0, MOST_F0) ** 0.5
    raised = (1.0 + root) / (1.0 - root)
    return f0, raised if ior >= 1.0 else 1.0 / raised


def _as_phong(
    graph: Graph, node: bpy.types.Node, scope: Scope, base: Colour, metallic: float
) -> Bsdf:
    """Metallic share m: k_s = m * base; the rest: a reflecting layer F0 over (1 - F0) * base."""
    value = partial(_number, graph, node, scope)
    level = 2.0 * value("Specular IOR Level", 0.5)
    layer = min(1.0, normal_reflectance(value("IOR", 1.5)) * level)
    tinted = bool(layer) and metallic < 1.0
    tint = colour(graph, node, "Specular Tint", scope) if tinted else np.ones(3)
    transmission = min(max(value("Transmission Weight"), 0.0), 1.0)
    k_s = metallic * base + (1.0 - metallic) * layer * tint
    k_d = (1.0 - metallic) * (1.0 - transmission) * (1.0 - clipped(layer * tint)) * base
    if not k_s.any():
        return Bsdf(k_d)
    note_anisotropy(graph, node, scope)
    what = "its strength is that seen head-on"
    graph.notes.approximated(graph.owner, "Principled reflection", what)
    return Bsdf(k_d, (phong_of(graph, node, k_s, scope),))


def _number(
    graph: Graph, node: bpy.types.Node, scope: Scope, name: str, default: float = 0.0
) -> float:
    return number(graph, node, name, scope, default)


def _note(graph: Graph, node: bpy.types.Node, scope: Scope, metallic: float) -> None:
    """Write down what the node asks for and the renderer does not know."""
    notes, owner = graph.notes, graph.owner
    value = partial(_number, graph, node, scope)
    if value("Alpha", 1.0) < 1.0 or linked(node, "Alpha"):
        notes.ignored(owner, "Alpha", "rendered opaque")
    if metallic < 1.0:
        if value("Transmission Weight") > 0.0:
            what = "nothing is refracted: that light is absorbed"
            notes.approximated(owner, "Transmission", what)
        if value("Subsurface Weight") > 0.0:
            notes.approximated(owner, "Subsurface", "rendered as diffuse")
        if value("Diffuse Roughness") > 0.0:
            notes.approximated(owner, "Diffuse roughness", "rendered as Lambertian")
    for name in ("Coat Weight", "Sheen Weight", "Thin Film Thickness"):
        if value(name) > 0.0:
            notes.ignored(owner, name.rsplit(" ", 1)[0], "left out")
    note_normal(graph, node)
    if linked(node, "Coat Normal"):
        notes.ignored(owner, "Coat Normal")
