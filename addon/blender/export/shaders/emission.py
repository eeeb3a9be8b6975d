# SPDX-License-Identifier: GPL-3.0-or-later
"""What glows: Emission, and Principled's."""

from __future__ import annotations

import bpy
import numpy as np

from ..nodes import Graph, Scope
from .bsdf import Bsdf, Colour, SpecularModel, colour, number


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read an Emission node."""
    return Bsdf(np.zeros(3), emission=radiance(graph, node, scope, "Color", "Strength"))


def radiance(
    graph: Graph, node: bpy.types.Node, scope: Scope, of_colour: str, of_strength: str
) -> Colour:
    """What inputs of these names give [W/(m^2 sr)]; light that would be negative is none."""
    strength = number(graph, node, of_strength, scope)
    if strength <= 0.0:
        return np.zeros(3)
    return np.maximum(strength * colour(graph, node, of_colour, scope), 0.0)
