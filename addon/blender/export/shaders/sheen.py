# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheen BSDF: fibres, or Ashikhmin's velvet; and Principled's."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from .bsdf import Bsdf, ShaderLobe, SpecularModel, as_diffuse, clipped


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
    if not below.emission.is_just(0.0):
        graph.notes.approximated(graph.owner, "Emission below sheen", "the sheen does not dim it")
    tint = clipped(weight * graph.input(node, "Sheen Tint", scope))
    roughness = graph.input(node, "Sheen Roughness", scope).clamp()
    return below.beneath(ShaderLobe("sheen", tint, {"roughness": roughness}))
