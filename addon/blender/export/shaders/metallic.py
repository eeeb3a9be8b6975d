# SPDX-License-Identifier: GPL-3.0-or-later
"""Metallic BSDF: microfacets of metal."""

from __future__ import annotations

import bpy
import numpy as np

from ....photon.scene import RGB, Lobe
from ..nodes import Graph, Scope
from .bsdf import (
    Bsdf,
    Colour,
    SpecularModel,
    clipped,
    colour,
    note_anisotropy,
    note_normal,
    phong_of,
    triple,
)
from .microfacets import along, microfacets

COSINE_82 = 1.0 / 7.0  # of the angle at which the F82 tint counts


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    note_normal(graph, node)
    if node.fresnel_type == "PHYSICAL_CONDUCTOR":
        index, extinction = (colour(graph, node, name, scope) for name in ("IOR", "Extinction"))
        graph.notes.approximated(
            graph.owner, "Physical Conductor", "its colour is exact at 0 and 82 degrees only"
        )
        base = conductor(index, extinction, 1.0)
        tint = conductor(index, extinction, COSINE_82) / _schlick(base, COSINE_82)
    else:
        base, tint = (colour(graph, node, name, scope) for name in ("Base Color", "Edge Tint"))
    return metal(graph, node, scope, model, base, tint)


def metal(
    graph: Graph,
    node: bpy.types.Node,
    scope: Scope,
    model: SpecularModel,
    base: Colour,
    tint: Colour,
) -> Bsdf:
    """Metal of a reflectance head-on, and at 82 degrees of `tint` over Schlick's curve."""
    if model is SpecularModel.PHONG:
        note_anisotropy(graph, node, scope)
        what = "its colour does not change to the edge"
        graph.notes.approximated(graph.owner, "Metal", what)
        return Bsdf(np.zeros(3), (phong_of(graph, node, base, scope),))
    tints: dict[str, float | RGB] = {"tint": triple(clipped(tint))}
    parameters = {**microfacets(graph, node, scope), **tints}
    lobe = Lobe("ggx_metal", triple(clipped(base)), parameters)
    return along(graph, node, scope, Bsdf(np.zeros(3), (lobe,)))


def conductor(index: Colour, extinction: Colour, cosine: float) -> Colour:
    """Unpolarised reflectance of metal of a complex index (Born & Wolf, sec. 14.2)."""
    n2, k2, c2 = index * index, extinction * extinction, cosine * cosine
    s2 = 1.0 - c2
    t = n2 - k2 - s2
    a2b2 = np.sqrt(t * t + 4.0 * n2 * k2)
    a = np.sqrt(np.maximum(0.5 * (a2b2 + t), 0.0))
    perpendicular = (a2b2 + c2 - 2.0 * a * cosine) / (a2b2 + c2 + 2.0 * a * cosine)
    along = (c2 * a2b2 + s2 * s2 - 2.0 * a * cosine * s2) / (
        c2 * a2b2 + s2 * s2 + 2.0 * a * cosine * s2
    )
    return 0.5 * perpendicular * (1.0 + along)


def _schlick(f0: Colour, cosine: float) -> Colour:
    return f0 + (1.0 - f0) * (1.0 - cosine) ** 5
