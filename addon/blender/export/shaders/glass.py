# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass BSDF: a dielectric's reflection; what it would refract is absorbed."""

from __future__ import annotations

import bpy

from ..graph import Graph, Scope
from ..programs import ZERO, math
from .bsdf import NO_INTERFACE, Bsdf, SpecularModel, clipped, colour, number, phong_of
from .microfacets import microfacets
from .principled import head_on, over_diffuse


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's reflection."""
    graph.notes.approximated(
        graph.owner, f"{node.bl_label}", "nothing is refracted: only its reflection is rendered"
    )
    ior = math("MAXIMUM", number(graph, node, "IOR", scope, 1.5), 1e-5)
    f0, tint = head_on(ior), colour(graph, node, "Color", scope)
    if model is SpecularModel.PHONG:
        return Bsdf(lobes=(phong_of(graph, node, f0 * tint, scope),))
    if ior.is_constant and abs(ior.number - 1.0) < NO_INTERFACE:
        return Bsdf()
    if tint.is_constant and tint.colour.min() < tint.colour.max():
        graph.notes.approximated(graph.owner, "Glass colour", "its reflections whiten to the edge")
    # The colour tints what is reflected at every angle: as a weight where it is grey.
    parts = [clipped(tint).part(name) for name in "xyz"]
    weight = math("MAXIMUM", math("MAXIMUM", parts[0], parts[1]), parts[2])
    if not weight.may_exceed(0.0):
        return Bsdf()
    parameters = microfacets(graph, node, scope)
    return over_diffuse(ZERO, clipped(f0 * tint / weight), ior, parameters).scaled(weight)
