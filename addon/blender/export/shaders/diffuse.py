# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse BSDF: Lambert's lobe, or that of a rough surface."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .bsdf import Bsdf, ShaderLobe, SpecularModel, clipped

SMOOTH = 1e-5  # the roughness up to which Cycles takes it for none


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    roughness = graph.input(node, "Roughness", scope)
    return rough_diffuse(graph, graph.input(node, "Color", scope), roughness, model)


def rough_diffuse(graph: Graph, albedo: Value, roughness: Value, model: SpecularModel) -> Bsdf:
    """A diffuse surface, by the Oren-Nayar model where it is rough."""
    if not roughness.may_exceed(SMOOTH):
        return Bsdf(albedo)
    if model is SpecularModel.PHONG:
        graph.notes.approximated(graph.owner, "Diffuse roughness", "rendered as Lambertian")
        return Bsdf(albedo)
    if bpy.app.version < (4, 3):
        what = "by the model that Blender has from 4.3 on"
        graph.notes.approximated(graph.owner, "Diffuse roughness", what)
    parameters = {"diffuse_roughness": roughness.clamp()}
    return Bsdf(lobes=(ShaderLobe("oren_nayar", clipped(albedo), parameters),))


def read_translucent(
    graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel
) -> Bsdf:
    """Read a Translucent BSDF."""
    return translucent(graph.input(node, "Color", scope))


def translucent(colour: Value) -> Bsdf:
    """What scatters light over its other side."""
    return Bsdf(lobes=(ShaderLobe("translucent", clipped(colour), {}),))
