# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse BSDF: Lambert's lobe."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope
from .bsdf import Bsdf, SpecularModel, colour, number


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's albedo."""
    if number(graph, node, "Roughness", scope).may_exceed(0.0):
        graph.notes.approximated(graph.owner, "Diffuse roughness", "rendered as Lambertian")
    return Bsdf(colour(graph, node, "Color", scope))
