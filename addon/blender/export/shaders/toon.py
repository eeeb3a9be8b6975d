# SPDX-License-Identifier: GPL-3.0-or-later
"""Toon BSDF: cones of light."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from .bsdf import Bsdf, ShaderLobe, SpecularModel, as_diffuse, clipped

KINDS = {"DIFFUSE": "toon", "GLOSSY": "glossy_toon"}


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    if model is SpecularModel.PHONG:
        return as_diffuse(graph, node, scope)
    size, edge = (graph.input(node, name, scope).clamp() for name in ("Size", "Smooth"))
    tint = clipped(graph.input(node, "Color", scope))
    lobe = ShaderLobe(KINDS[node.component], tint, {"size": size, "edge": edge})
    return Bsdf(lobes=(lobe,))
