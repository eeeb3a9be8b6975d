# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled's coat."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..graph import Graph, Scope, linked
from ..programs import Value, math, value
from .bsdf import Bsdf, Colour, ShaderLobe, clipped, colour, number

ANGLES = 64  # of rays through the coat, to average what it lets through


def under_coat(graph: Graph, node: bpy.types.Node, scope: Scope, below: Bsdf) -> Bsdf:
    """What the coat lies over, and the coat, if there is any."""
    cover = number(graph, node, "Coat Weight", scope).clamp()
    if cover.is_just(0.0):
        return below
    if linked(node, "Coat Normal", scope):
        graph.notes.ignored(graph.owner, "Coat Normal", "the coat has the normal of the base")
    elif linked(node, "Normal", scope):
        what = "the coat bends with the base: a material has one normal"
        graph.notes.approximated(graph.owner, "Coat Normal", what)
    tint = clipped(colour(graph, node, "Coat Tint", scope))
    ior = math("MAXIMUM", number(graph, node, "Coat IOR", scope, 1.5), 1.0)
    roughness = number(graph, node, "Coat Roughness", scope).clamp()
    if not below.emission.is_just(0.0):
        below = replace(below, emission=below.emission * _of_glow(graph, tint, ior, cover))
    parameters = {"alpha": roughness * roughness, "ior": ior, "cover": cover}
    return below.beneath(ShaderLobe("coat", tint, parameters))


def _of_glow(graph: Graph, tint: Value, ior: Value, cover: Value) -> Value:
    """The share of what glows below a coat that it lets through."""
    if not (tint.is_constant and ior.is_constant and cover.is_constant):
        what = "a coat that differs from point to point does not dim it"
        graph.notes.approximated(graph.owner, "Emission below a coat", what)
        return value(1.0)
    what = "as bright in all directions, as it is on average"
    graph.notes.approximated(graph.owner, "Emission below a coat", what)
    return value(let_through(tint.colour, ior.number, cover.number))


def let_through(tint: Colour, ior: float, cover: float) -> Colour:
    """What a smooth coat lets through of a diffuse glow below it."""
    squared = (np.arange(ANGLES) + 0.5) / ANGLES  # cosines as often as a diffuse glow has them
    cosine, inside = np.sqrt(squared), np.sqrt(1.0 - (1.0 - squared) / ior**2)
    beside = ((cosine - ior * inside) / (cosine + ior * inside)) ** 2
    along = ((ior * cosine - inside) / (ior * cosine + inside)) ** 2
    passed = 1.0 - cover * 0.5 * (beside + along)
    tinted = 1.0 - cover + cover * tint ** (1.0 / inside[:, None])
    shares: Colour = (passed[:, None] * tinted).mean(axis=0)
    return shares
