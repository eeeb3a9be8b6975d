# SPDX-License-Identifier: GPL-3.0-or-later
"""Glossy BSDF: microfacets of one reflectance."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from .bsdf import Bsdf, ShaderLobe, SpecularModel, is_smooth, note_anisotropy, phong_of
from .microfacets import microfacets, with_tangent


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    reflectance = graph.input(node, "Color", scope)
    if model is SpecularModel.PHONG:
        note_anisotropy(graph, node, scope)
        return Bsdf(lobes=(phong_of(graph, node, reflectance, scope),))
    parameters = microfacets(graph, node, scope)
    if is_smooth(parameters):
        return Bsdf(lobes=(ShaderLobe("mirror", reflectance, {}),))
    lobe = ShaderLobe("ggx", reflectance, parameters)
    return with_tangent(graph, node, scope, Bsdf(lobes=(lobe,)))
