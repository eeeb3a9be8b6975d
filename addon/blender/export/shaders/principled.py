# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled BSDF: metal, or a dielectric's microfacets over a diffuse base; a coat and sheen over
them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, ZERO, Value, math, mix, value
from . import thin_wall
from .bsdf import (
    CLEAR,
    NO_INTERFACE,
    Bsdf,
    ShaderLobe,
    SpecularModel,
    clipped,
    head_on,
    note_anisotropy,
    note_thin_film,
    phong_of,
    surface_of,
    transparent,
)
from .coat import under_coat
from .diffuse import rough_diffuse
from .emission import radiance
from .glass import ALL, glass
from .metallic import metal
from .microfacets import microfacets, with_tangent
from .sheen import under_sheen
from .subsurface import of_principled

MOST_F0 = 0.99  # beyond which the specular level raises no index any more
# What Cycles gives to objects without a material, Blender 5.0 on.
DEFAULT_BASE, DEFAULT_ROUGHNESS, DEFAULT_IOR = (0.8, 0.8, 0.8), 0.5, 1.5


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf | None:
    """Read what there is of it, and what its Alpha lets pass."""
    alpha = graph.input(node, "Alpha", scope).clamp()
    if alpha.is_just(0.0):
        return CLEAR
    found = _surface(graph, node, scope, model)
    if alpha.is_just(1.0):
        return found
    return found.scaled(alpha).plus(surface_of(transparent(ONE - alpha)))


def _surface(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read metallic and dielectric shares, and what lies over them; the rest is reported."""
    base = math("MAXIMUM", graph.input(node, "Base Color", scope), 0.0)
    metallic = graph.input(node, "Metallic", scope).clamp()
    _note(graph, node, scope, metallic, model)
    found = Bsdf(emission=radiance(graph, node, scope, "Emission Color", "Emission Strength"))
    if model is SpecularModel.PHONG:
        return found.plus(_as_phong(graph, node, scope, base, metallic))
    if metallic.may_exceed(0.0):
        tint = graph.input(node, "Specular Tint", scope)
        found = found.plus(metal(graph, node, scope, model, base, tint).scaled(metallic))
    if not metallic.is_just(1.0):
        found = found.plus(_dielectric(graph, node, scope, base).scaled(ONE - metallic))
    found = under_coat(graph, node, scope, found)
    return under_sheen(graph, node, scope, found)


def default() -> Bsdf:
    """What Cycles gives to objects without a material."""
    alpha, ior = value(DEFAULT_ROUGHNESS**2), value(DEFAULT_IOR)
    parameters = {"alpha_x": alpha, "alpha_y": alpha, "turn": ZERO, "compensated": ONE}
    return over_diffuse(value(DEFAULT_BASE), head_on(ior), ior, parameters)


def over_diffuse(base: Value, f0: Value, ior: Value, parameters: Mapping[str, Value]) -> Bsdf:
    """A dielectric's lobe, of a reflectance head-on, over a diffuse albedo."""
    given = {**parameters, "ior": ior}
    return Bsdf(lobes=(ShaderLobe("ggx_dielectric", f0, given, covered=base),))


def _dielectric(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value) -> Bsdf:
    given = partial(graph.input, node, scope=scope)
    transmission = given("Transmission Weight").clamp()
    found = Bsdf()
    if transmission.may_exceed(0.0):
        found = found.plus(_glass(graph, node, scope, base).scaled(transmission))
    if transmission.is_just(1.0):
        return found
    return found.plus(_opaque(graph, node, scope, base).scaled(ONE - transmission))


def _glass(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value) -> Bsdf:
    if thin_wall.is_thin(graph, node, scope):
        return thin_wall.glass(graph, node, scope, base)
    tint = math("MAXIMUM", graph.input(node, "Specular Tint", scope), 0.0)
    return Bsdf(lobes=(glass(graph, node, scope, math("SQRT", clipped(base)), ALL, tint),))


def _opaque(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value) -> Bsdf:
    given = partial(graph.input, node, scope=scope)
    f0, ior = level_of(given("IOR"), given("Specular IOR Level"))
    under = _base(graph, node, scope, base, ior)
    if ior.is_constant and abs(ior.number - 1.0) < NO_INTERFACE:
        return under
    tint = math("MAXIMUM", graph.input(node, "Specular Tint", scope), 0.0)
    parameters = microfacets(graph, node, scope)
    lobe = ShaderLobe("ggx_dielectric", clipped(f0 * tint), {**parameters, "ior": ior})
    return with_tangent(graph, node, scope, under.beneath(lobe))


def _base(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value, ior: Value) -> Bsdf:
    """What the interface of a dielectric lies over."""
    roughness = graph.input(node, "Diffuse Roughness", scope, 0.0)
    rough = rough_diffuse(graph, base, roughness, SpecularModel.GGX)
    below = graph.input(node, "Subsurface Weight", scope).clamp()
    if below.is_just(0.0):
        return rough
    if thin_wall.is_thin(graph, node, scope):
        found = thin_wall.below(graph, node, scope, clipped(base), roughness)
    else:
        found = of_principled(graph, node, scope, clipped(base), ior)
    return rough.scaled(ONE - below).plus(found.scaled(below))


def level_of(ior: Value, level: Value) -> tuple[Value, Value]:
    """A dielectric's reflectance head-on, and the index whose curve leads on from there.

    As Cycles has it: a Specular IOR Level other than 0.5 changes both.
    """
    ior = math("MAXIMUM", ior, 1e-5 if ior.is_constant else 1.0 + 2.0 * NO_INTERFACE)
    f0 = head_on(ior)
    if level.is_just(0.5):
        return f0, ior
    f0 = f0 * math("MAXIMUM", level * 2.0, 0.0)
    root = math("SQRT", math("MINIMUM", f0, MOST_F0))
    raised = (1.0 + root) / (1.0 - root)
    return f0, mix(raised, 1.0 / raised, math("LESS_THAN", ior, 1.0))


def _as_phong(
    graph: Graph, node: bpy.types.Node, scope: Scope, base: Value, metallic: Value
) -> Bsdf:
    """Metallic share m: k_s = m * base; the rest: a reflecting layer F0 over (1 - F0) * base."""
    given = partial(graph.input, node, scope=scope)
    level = given("Specular IOR Level") * 2.0
    layer = math("MINIMUM", head_on(given("IOR")) * level, 1.0)
    tinted = layer.may_exceed(0.0) and not metallic.is_just(1.0)
    tint = graph.input(node, "Specular Tint", scope) if tinted else ONE
    transmission = given("Transmission Weight").clamp()
    k_s = metallic * base + (ONE - metallic) * (ONE - transmission) * layer * tint
    k_d = (ONE - metallic) * (ONE - transmission) * (ONE - clipped(layer * tint)) * base
    found = Bsdf(k_d)
    if transmission.may_exceed(0.0) and not metallic.is_just(1.0):
        share = transmission * (ONE - metallic)
        found = found.plus(_glass(graph, node, scope, base).scaled(share))
    if k_s.is_just(0.0):
        return found
    note_anisotropy(graph, node, scope)
    what = "its strength is that seen head-on"
    graph.notes.approximated(graph.owner, "Principled reflection", what)
    return found.plus(Bsdf(lobes=(phong_of(graph, node, k_s, scope),)))


def _note(
    graph: Graph, node: bpy.types.Node, scope: Scope, metallic: Value, model: SpecularModel
) -> None:
    """Write down what the node asks for and the renderer does not know."""
    notes, owner = graph.notes, graph.owner
    given = partial(graph.input, node, scope=scope, otherwise=0.0)
    if not metallic.is_just(1.0):
        if model is SpecularModel.PHONG and given("Subsurface Weight").may_exceed(0.0):
            notes.approximated(owner, "Subsurface", "rendered as diffuse")
        if model is SpecularModel.PHONG and given("Diffuse Roughness").may_exceed(0.0):
            notes.approximated(owner, "Diffuse roughness", "rendered as Lambertian")
    left_out = ("Coat Weight", "Sheen Weight") if model is SpecularModel.PHONG else ()
    note_thin_film(graph, node, scope)
    for name in left_out:
        if given(name).may_exceed(0.0):
            notes.ignored(owner, name.rsplit(" ", 1)[0], "left out")
