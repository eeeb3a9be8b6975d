# SPDX-License-Identifier: GPL-3.0-or-later
"""Glossy BSDF: microfacets of one reflectance."""

from __future__ import annotations

import bpy
import numpy as np

from ....photon.scene import Lobe
from ..nodes import Graph, Scope
from .bsdf import (
    Bsdf,
    SpecularModel,
    colour,
    is_smooth,
    note_anisotropy,
    note_normal,
    phong_of,
    triple,
)
from .microfacets import along, microfacets


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    note_normal(graph, node)
    reflectance = colour(graph, node, "Color", scope)
    if model is SpecularModel.PHONG:
        note_anisotropy(graph, node, scope)
        return Bsdf(np.zeros(3), (phong_of(graph, node, reflectance, scope),))
    parameters = microfacets(graph, node, scope)
    if is_smooth(parameters):
        return Bsdf(np.zeros(3), (Lobe("mirror", triple(reflectance)),))
    lobe = Lobe("ggx", triple(reflectance), parameters)
    return along(graph, node, scope, Bsdf(np.zeros(3), (lobe,)))
