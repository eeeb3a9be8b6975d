# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass BSDF: a dielectric's reflection; what it would refract is absorbed."""

from __future__ import annotations

import bpy
import numpy as np

from ..nodes import Graph, Scope, normal_reflectance
from .bsdf import (
    BLACK,
    NO_INTERFACE,
    Bsdf,
    SpecularModel,
    clipped,
    colour,
    number,
    phong_of,
)
from .microfacets import microfacets
from .principled import over_diffuse


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's reflection."""
    graph.notes.approximated(
        graph.owner, f"{node.bl_label}", "nothing is refracted: only its reflection is rendered"
    )
    ior = max(number(graph, node, "IOR", scope, 1.5), 1e-5)
    f0, tint = normal_reflectance(ior), colour(graph, node, "Color", scope)
    if model is SpecularModel.PHONG:
        return Bsdf(np.zeros(3), (phong_of(graph, node, f0 * tint, scope),))
    # The colour tints what is reflected at every angle: as a weight where it is grey.
    weight = clipped(tint).max()
    if abs(ior - 1.0) < NO_INTERFACE or not weight > 0.0:
        return BLACK
    if tint.min() < tint.max():
        graph.notes.approximated(graph.owner, "Glass colour", "its reflections whiten to the edge")
    parameters = microfacets(graph, node, scope)
    reflection = over_diffuse(np.zeros(3), clipped(f0 * tint / weight), ior, parameters)
    return reflection.scaled(weight)
