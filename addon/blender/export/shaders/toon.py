# SPDX-License-Identifier: GPL-3.0-or-later
"""Toon BSDF: other lobes about as broad."""

from __future__ import annotations

from math import pi

import bpy

from ..graph import Graph, Scope
from ..programs import ONE, ZERO, math
from .bsdf import Bsdf, ShaderLobe, SpecularModel, as_diffuse, clipped, colour, number
from .microfacets import LEAST

FACETS = (
    0.7  # how far microfacets lean that reflect a cone about evenly, over how far its edge's do
)


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node as Lambert's lobe; its glossy component, a cone about the mirrored direction,
    as microfacets that scatter as far."""
    if node.component != "GLOSSY" or model is SpecularModel.PHONG:
        return as_diffuse(graph, node, scope)
    what = "rendered as glossy, about as broad, without an edge"
    graph.notes.approximated(graph.owner, f"{node.bl_label}", what)
    half = number(graph, node, "Size", scope).clamp() * (pi / 4.0)  # of the angle to the edge
    alpha = (math("TANGENT", half) * FACETS).clamp(LEAST, 1.0)
    parameters = {"alpha_x": alpha, "alpha_y": alpha, "turn": ZERO, "compensated": ONE}
    return Bsdf(
        lobes=(ShaderLobe("ggx", clipped(colour(graph, node, "Color", scope)), parameters),)
    )
