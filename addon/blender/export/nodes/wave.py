# SPDX-License-Identifier: GPL-3.0-or-later
"""Wave Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import choice, numbers, vector

# The numbers of glsl/nodes/wave.glsl.
DIRECTIONS = {"X": 0, "Y": 1, "Z": 2, "DIAGONAL": 3, "SPHERICAL": 3}
PROFILES = {"SIN": 0, "SAW": 1, "TRI": 2}
INPUTS = ("Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness")


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read either output: they are the same."""
    rings = node.wave_type == "RINGS"
    return graph.program.emit(
        "wave",
        vector=vector(graph, node, scope),
        **numbers(graph, node, scope, *INPUTS),
        phase=graph.input(node, "Phase Offset", scope),
        rings=choice(rings),
        direction=choice(DIRECTIONS[node.rings_direction if rings else node.bands_direction]),
        profile=choice(PROFILES[node.wave_profile]),
    )
