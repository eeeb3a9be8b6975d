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
    microfacets,
    number,
    phong_of,
)
from .principled import over_diffuse


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's reflection."""
    graph.notes.approximated(
        graph.owner, f"{node.bl_label}", "nothing is refracted: only its reflection is rendered"
    )
    ior = max(number(graph, node, "IOR", scope, 1.5), 1e-5)
    f0 = normal_reflectance(ior) * colour(graph, node, "Color", scope)
    if model is SpecularModel.PHONG:
        return Bsdf(np.zeros(3), (phong_of(graph, node, f0, scope),))
    if abs(ior - 1.0) < NO_INTERFACE:
        return BLACK
    return over_diffuse(np.zeros(3), clipped(f0), ior, microfacets(graph, node, scope))
