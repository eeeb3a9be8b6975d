# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheen BSDF: fibres, or Ashikhmin's velvet; and Principled's."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope
from .bsdf import (
    Bsdf,
    ShaderLobe,
    SpecularModel,
    as_diffuse,
    clipped,
    colour,
    number,
)


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    if model is SpecularModel.PHONG:
        return as_diffuse(graph, node, scope)
    roughness = number(graph, node, "Roughness", scope).clamp()
    tint = clipped(colour(graph, node, "Color", scope))
    if node.distribution == "ASHIKHMIN":
        return Bsdf(lobes=(ShaderLobe("velvet", tint, {"sigma": roughness}),))
    return Bsdf(lobes=(ShaderLobe("sheen", tint, {"roughness": roughness}),))


def under_sheen(graph: Graph, node: bpy.types.Node, scope: Scope, below: Bsdf) -> Bsdf:
    """What Principled's sheen lies over, and the sheen, if there is any."""
    weight = number(graph, node, "Sheen Weight", scope).clamp()
    if weight.is_just(0.0):
        return below
    if not below.emission.is_just(0.0):
        graph.notes.approximated(graph.owner, "Emission below sheen", "the sheen does not dim it")
    tint = clipped(weight * colour(graph, node, "Sheen Tint", scope))
    roughness = number(graph, node, "Sheen Roughness", scope, 0.5).clamp()
    return below.beneath(ShaderLobe("sheen", tint, {"roughness": roughness}))
