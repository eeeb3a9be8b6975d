# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled's coat."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..graph import Graph
from ..links import Scope, linked
from ..nodes.attributes import smooth
from ..programs import Value, math, value
from .bsdf import Bsdf, ShaderLobe, clipped

ANGLES = 64  # of rays through the coat, to average what it lets through
TYPICAL_IOR = 1.5  # of a coat whose own differs from point to point


def under_coat(graph: Graph, node: bpy.types.Node, scope: Scope, below: Bsdf) -> Bsdf:
    """What the coat lies over, and the coat, if there is any."""
    cover = graph.input(node, "Coat Weight", scope).clamp()
    if cover.is_just(0.0):
        return below
    tint = clipped(graph.input(node, "Coat Tint", scope))
    ior = math("MAXIMUM", graph.input(node, "Coat IOR", scope), 1.0)
    roughness = graph.input(node, "Coat Roughness", scope).clamp()
    if not below.emission.is_just(0.0):
        below = replace(below, emission=below.emission * _emission_share(graph, tint, ior, cover))
    parameters = {"alpha": roughness * roughness, "ior": ior, "cover": cover}
    own, kind = _own_normal(graph, node, scope), "coat"
    if own is not None:
        kind, half = "bent_coat", own * 0.5 + 0.5  # numbers are not negative
        parameters |= {f"normal_{name}": half.part(name) for name in "xyz"}
    return below.beneath(ShaderLobe(kind, tint, parameters))


def _own_normal(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value | None:
    """The coat's normal in world space, None if it is that of what it lies over: a base that is
    bent does not bend the coat."""
    base, own = (
        graph.input(node, name, scope) if linked(node, name, scope) else smooth(graph)
        for name in ("Normal", "Coat Normal")
    )
    base, own = (smooth(graph) if normal.is_just(0.0) else normal for normal in (base, own))
    return None if own == base else own


def _emission_share(graph: Graph, tint: Value, ior: Value, cover: Value) -> Value:
    """The share of the emission below a coat that it lets through."""
    what = "as bright in all directions, as it is on average"
    graph.notes.approximated(graph.owner, "Emission below a coat", what)
    return let_through(tint, ior.number if ior.is_constant else TYPICAL_IOR, cover)


def let_through(tint: Value, ior: float, cover: Value) -> Value:
    """What a smooth coat lets through of diffuse emission below it."""
    squared = (np.arange(ANGLES) + 0.5) / ANGLES  # cosines as often as diffuse emission has them
    cosine, inside = np.sqrt(squared), np.sqrt(1.0 - (1.0 - squared) / ior**2)
    perpendicular = ((cosine - ior * inside) / (cosine + ior * inside)) ** 2
    parallel = ((ior * cosine - inside) / (ior * cosine + inside)) ** 2
    reflected, longer = 0.5 * (perpendicular + parallel), 1.0 / inside
    if not tint.is_constant:  # as one ray of the mean length
        tinted = math("GAMMA", tint, float(longer.mean()))
        return (1.0 - cover * float(reflected.mean())) * (1.0 - cover * (1.0 - tinted))
    lost = 1.0 - tint.colour ** longer[:, None]
    # The mean of (1 - cover reflected) (1 - cover lost).
    once, twice = reflected.mean() + lost.mean(axis=0), (reflected[:, None] * lost).mean(axis=0)
    return 1.0 - cover * (value(once) - cover * value(twice))
