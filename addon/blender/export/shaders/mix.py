# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix Shader and Add Shader, and what lets light pass straight through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy

from ..graph import Graph
from ..links import Scope, source
from .bsdf import CLEAR, Bsdf, SpecularModel, surface_of, transparent
from .microfacets import note_tangents
from .normals import about_one_normal

Read = Callable[
    [Graph, bpy.types.Node | None, bpy.types.NodeSocket | None, Scope, SpecularModel], Bsdf | None
]


def read_mix(
    graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel, read: Read
) -> Bsdf | None:
    """Read both shaders; `read` is what reads any."""
    factor = graph.value(node.inputs[0], scope).clamp()
    for whole, index in ((0.0, 1), (1.0, 2)):
        if factor.is_just(whole):
            return _input(graph, node, index, scope, model, read)
    first, second = (_input(graph, node, index, scope, model, read) for index in (1, 2))
    if first is CLEAR and second is CLEAR:
        return CLEAR
    first, second = surface_of(first), surface_of(second)
    note_tangents(graph, first, second)
    shares = first.scaled(1.0 - factor), second.scaled(factor)
    first, second = about_one_normal(graph, *shares)
    return first.plus(second)


def read_add(
    graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel, read: Read
) -> Bsdf | None:
    """Read both shaders; `read` is what reads any."""
    first, second = (_input(graph, node, index, scope, model, read) for index in (0, 1))
    if first is CLEAR and second is CLEAR:
        return CLEAR
    first, second = surface_of(first), surface_of(second)
    note_tangents(graph, first, second)
    first, second = about_one_normal(graph, first, second)
    both = first.plus(second)
    return replace(both, adds=both.adds or (first.reflects and second.reflects))


def read_transparent(
    graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel
) -> Bsdf | None:
    """Read a Transparent BSDF."""
    return transparent(graph.input(node, "Color", scope))


def _input(
    graph: Graph,
    node: bpy.types.Node,
    index: int,
    scope: Scope,
    model: SpecularModel,
    read: Read,
) -> Bsdf | None:
    return read(graph, *source(node.inputs[index], scope), model)
