# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled Hair BSDF, as a diffuse surface of the colour that much of its hair has."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, Value, math, value
from .bsdf import Bsdf, SpecularModel, clipped

# What absorbs light in hair, eumelanin and pheomelanin, by channel (d'Eon et al. 2011).
EUMELANIN, PHEOMELANIN = (0.506, 0.841, 1.653), (0.343, 0.733, 1.924)


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's colour, of whatever it is made."""
    graph.notes.approximated(graph.owner, node.bl_label, "rendered as diffuse")
    if node.parametrization == "COLOR":
        return Bsdf(clipped(graph.input(node, "Color", scope)))
    if node.parametrization == "ABSORPTION":
        return Bsdf(_seen(graph, node, scope, graph.input(node, "Absorption Coefficient", scope)))
    left = math("MAXIMUM", ONE - graph.input(node, "Melanin", scope).clamp(), 1e-4)
    amount, red = 0.0 - _log(left), graph.input(node, "Melanin Redness", scope).clamp()
    absorbed = amount * (value(EUMELANIN) * (ONE - red) + value(PHEOMELANIN) * red)
    tint = graph.input(node, "Tint", scope)
    return Bsdf(clipped(_seen(graph, node, scope, absorbed) * tint))


def _seen(graph: Graph, node: bpy.types.Node, scope: Scope, absorbed: Value) -> Value:
    """The colour of hair that absorbs so much, by the fit of Chiang et al. 2016, sec. 4.2."""
    rough = graph.input(node, "Radial Roughness", scope, 0.3).clamp()  # Huang's model has none
    terms = (5.969, -0.215, 2.532, -10.73, 5.574, 0.245)
    fit = value(terms[0])
    power = ONE
    for term in terms[1:]:
        power = power * rough
        fit = fit + power * term
    return _exp(0.0 - math("SQRT", math("MAXIMUM", absorbed, 0.0)) * fit)


def _log(at: Value) -> Value:
    return math("LOGARITHM", at, 2.718281828459045)


def _exp(at: Value) -> Value:
    return math("EXPONENT", at)
