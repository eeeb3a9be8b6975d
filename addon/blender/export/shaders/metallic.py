# SPDX-License-Identifier: GPL-3.0-or-later
"""Metallic BSDF: microfacets of metal."""

from __future__ import annotations

import bpy
import numpy as np

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, Value, math, value
from .bsdf import (
    Bsdf,
    ShaderLobe,
    SpecularModel,
    clipped,
    note_anisotropy,
    note_thin_film,
    phong_of,
)
from .microfacets import microfacets, with_tangent

COSINE_82 = 1.0 / 7.0  # of the angle at which the F82 tint counts


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    note_thin_film(graph, node, scope)
    if node.fresnel_type == "PHYSICAL_CONDUCTOR":
        index, extinction = (graph.input(node, name, scope) for name in ("IOR", "Extinction"))
        graph.notes.approximated(
            graph.owner, "Physical Conductor", "its colour is exact at 0 and 82 degrees only"
        )
        base = conductor(index, extinction, 1.0)
        tint = conductor(index, extinction, COSINE_82) / _schlick(base, COSINE_82)
    else:
        base, tint = (graph.input(node, name, scope) for name in ("Base Color", "Edge Tint"))
    return metal(graph, node, scope, model, base, tint)


def metal(
    graph: Graph,
    node: bpy.types.Node,
    scope: Scope,
    model: SpecularModel,
    base: Value,
    tint: Value,
) -> Bsdf:
    """Metal of a reflectance head-on, and at 82 degrees of `tint` over Schlick's curve."""
    if model is SpecularModel.PHONG:
        note_anisotropy(graph, node, scope)
        what = "its colour does not change to the edge"
        graph.notes.approximated(graph.owner, "Metal", what)
        return Bsdf(lobes=(phong_of(graph, node, base, scope),))
    parameters = {**microfacets(graph, node, scope), "tint": clipped(tint)}
    lobe = ShaderLobe("ggx_metal", clipped(base), parameters)
    return with_tangent(graph, node, scope, Bsdf(lobes=(lobe,)))


def conductor(index: Value, extinction: Value, cosine: float) -> Value:
    """Unpolarised reflectance of metal of a complex index (Born & Wolf, sec. 14.2)."""
    n2, k2, c2 = index * index, extinction * extinction, cosine * cosine
    s2 = 1.0 - c2
    t = n2 - k2 - s2
    a2b2 = math("SQRT", t * t + 4.0 * n2 * k2)
    a = math("SQRT", 0.5 * (a2b2 + t))
    perpendicular = (a2b2 + c2 - 2.0 * a * cosine) / (a2b2 + c2 + 2.0 * a * cosine)
    along = (c2 * a2b2 + s2 * s2 - 2.0 * a * cosine * s2) / (
        c2 * a2b2 + s2 * s2 + 2.0 * a * cosine * s2
    )
    return 0.5 * perpendicular * (1.0 + along)


def _schlick(f0: Value, cosine: float) -> Value:
    return f0 + (ONE - f0) * value((1.0 - np.float64(cosine)) ** 5)
