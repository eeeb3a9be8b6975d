# SPDX-License-Identifier: GPL-3.0-or-later
"""Toon BSDF: cones of light."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope
from .bsdf import Bsdf, ShaderLobe, SpecularModel, as_diffuse, clipped, colour, number

KINDS = {"DIFFUSE": "toon", "GLOSSY": "glossy_toon"}


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    if model is SpecularModel.PHONG:
        return as_diffuse(graph, node, scope)
    size, edge = (number(graph, node, name, scope).clamp() for name in ("Size", "Smooth"))
    tint = clipped(colour(graph, node, "Color", scope))
    lobe = ShaderLobe(KINDS[node.component], tint, {"size": size, "edge": edge})
    return Bsdf(lobes=(lobe,))
