# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheen BSDF: fibres, or Ashikhmin's velvet; and Principled's."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value, math, value
from .bsdf import Bsdf, ShaderLobe, SpecularModel, as_diffuse, clipped

# What white sheen reflects of light from all around, by powers of its roughness, the highest first:
# the mean of glsl/lib/sheen.glsl's, to 0.002.
ALBEDO = (-0.4356, 0.514, 0.4146, -0.0487, 0.0019)


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    if model is SpecularModel.PHONG:
        return as_diffuse(graph, node, scope)
    roughness = graph.input(node, "Roughness", scope).clamp()
    tint = clipped(graph.input(node, "Color", scope))
    if node.distribution == "ASHIKHMIN":
        return Bsdf(lobes=(ShaderLobe("velvet", tint, {"sigma": roughness}),))
    return Bsdf(lobes=(ShaderLobe("sheen", tint, {"roughness": roughness}),))


def under_sheen(graph: Graph, node: bpy.types.Node, scope: Scope, below: Bsdf) -> Bsdf:
    """What Principled's sheen lies over, and the sheen, if there is any."""
    weight = graph.input(node, "Sheen Weight", scope).clamp()
    if weight.is_just(0.0):
        return below
    tint = clipped(weight * graph.input(node, "Sheen Tint", scope))
    roughness = graph.input(node, "Sheen Roughness", scope).clamp()
    if not below.emission.is_just(0.0):
        what = "as bright in all directions, as it is on average"
        graph.notes.approximated(graph.owner, "Emission below sheen", what)
        below = replace(below, emission=below.emission * let_through(tint, roughness))
    return below.beneath(ShaderLobe("sheen", tint, {"roughness": roughness}))


def let_through(tint: Value, roughness: Value) -> Value:
    """What sheen lets through of diffuse emission below it."""
    albedo = value(ALBEDO[0])
    for coefficient in ALBEDO[1:]:
        albedo = albedo * roughness + coefficient
    largest = math("MAXIMUM", math("MAXIMUM", tint.part("x"), tint.part("y")), tint.part("z"))
    return 1.0 - largest * albedo.clamp()
