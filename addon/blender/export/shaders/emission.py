# SPDX-License-Identifier: GPL-3.0-or-later
"""Emission, and Principled's."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, ZERO, Value, math
from .bsdf import Bsdf, SpecularModel


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read an Emission node."""
    return Bsdf(emission=radiance(graph, node, scope, "Color", "Strength"))


def emitted(found: Value) -> Bsdf:
    """What a colour or a number is in place of a shader: the radiance it emits."""
    return Bsdf(emission=math("MAXIMUM", found * ONE, 0.0))


def radiance(
    graph: Graph, node: bpy.types.Node, scope: Scope, of_colour: str, of_strength: str
) -> Value:
    """What inputs of these names give [W/(m^2 sr)]; light that would be negative is none."""
    strength = graph.input(node, of_strength, scope)
    if strength.is_constant and strength.number < 0.0:
        graph.notes.approximated(graph.owner, "Negative light", "0 is used")
    if not strength.may_exceed(0.0):
        return ZERO
    positive = math("MAXIMUM", strength, 0.0)
    return math("MAXIMUM", positive * graph.input(node, of_colour, scope), 0.0)
