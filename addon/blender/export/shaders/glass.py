# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass BSDF, Refraction BSDF, what Principled BSDF lets through, and the dispersion of these."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, ZERO, Value, math, value
from .bsdf import (
    NO_INTERFACE,
    SMOOTH,
    Bsdf,
    ShaderLobe,
    SpecularModel,
    clipped,
    note_thin_film,
    roughness_of,
)
from .microfacets import LEAST, is_compensated

# What reflection is multiplied by (glsl/lib/glass.glsl).
NOTHING, ALL, COLOUR = ZERO, ONE, value(2.0)


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read a Glass BSDF, whose colour tints what it reflects as well."""
    return _of_node(graph, node, scope, COLOUR)


def read_refraction(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read a Refraction BSDF: where all would be reflected it is black."""
    return _of_node(graph, node, scope, NOTHING)


def glass(
    graph: Graph,
    node: bpy.types.Node,
    scope: Scope,
    passed: Value,
    reflects: Value,
    tint: Value = ONE,
) -> ShaderLobe:
    """The lobe of a node's roughness and index; `passed`: what refraction is multiplied by, `tint`:
    what reflection head-on is."""
    index = graph.input(node, "IOR", scope)
    parameters = {"ior": math("MAXIMUM", index, 1e-5), "tint": clipped(tint), "reflects": reflects}
    parameters["open"] = ZERO  # of a mesh that is, MaterialTable makes another material
    roughness = roughness_of(graph, node, scope)
    alpha = roughness * roughness
    is_nothing = index.is_constant and abs(index.number - 1.0) < NO_INTERFACE
    if is_nothing:
        return ShaderLobe("transparent", clipped(passed), {})
    if not (alpha * alpha).may_exceed(SMOOTH):
        return ShaderLobe("glass", clipped(passed), parameters)
    alpha = alpha.clamp(0.0 if alpha.is_constant else LEAST, 1.0)
    compensated = is_compensated(graph, node)
    rough = {"alpha": alpha, "compensated": ZERO if reflects is NOTHING else compensated}
    return ShaderLobe("ggx_glass", clipped(passed), rough | parameters)


def dispersing(bsdf: Bsdf, dispersion: float) -> Bsdf:
    """The same whose glass bends each wavelength otherwise; `dispersion`: 1 / Abbe number, > 0."""
    return replace(bsdf, lobes=tuple(_dispersing(lobe, dispersion) for lobe in bsdf.lobes))


def _dispersing(lobe: ShaderLobe, dispersion: float) -> ShaderLobe:
    parameters = {**lobe.parameters, "dispersion": value(dispersion)}
    if lobe.kind == "glass":
        return replace(lobe, kind="dispersive_glass", parameters=parameters)
    if lobe.kind != "ggx_glass":
        return lobe
    reflects, compensated = parameters.pop("reflects"), parameters.pop("compensated")
    parameters["switches"] = 2.0 * reflects + compensated
    return replace(lobe, kind="ggx_dispersive_glass", parameters=parameters)


def _of_node(graph: Graph, node: bpy.types.Node, scope: Scope, reflects: Value) -> Bsdf:
    note_thin_film(graph, node, scope)
    passed = graph.input(node, "Color", scope)
    lobe = glass(graph, node, scope, passed, reflects)
    return Bsdf(lobes=(lobe,)) if lobe.colour.may_exceed(0.0) else Bsdf()
