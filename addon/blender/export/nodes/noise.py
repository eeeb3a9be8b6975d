# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import choice, numbers, place

# The numbers of glsl/lib/fractal.glsl.
KINDS = {
    "FBM": 0,
    "MULTIFRACTAL": 1,
    "HYBRID_MULTIFRACTAL": 2,
    "RIDGED_MULTIFRACTAL": 3,
    "HETERO_TERRAIN": 4,
}
INPUTS = ("Scale", "Detail", "Roughness", "Lacunarity", "Offset", "Gain", "Distortion")


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read the factor or the colour. Without links to the colour two channels are saved."""
    dimensions, inputs = node.noise_dimensions, numbers(graph, node, scope, *INPUTS)
    result = graph.program.emit(
        f"noise_{dimensions.lower()}",
        **place(graph, node, scope, dimensions),
        **inputs,
        kind=choice(KINDS[node.noise_type]),
        normalized=choice(node.normalize),
        coloured=choice(node.outputs["Color"].is_linked),
        distorted=choice(not inputs["distortion"].is_just(0.0)),
    )
    return result if output.identifier == "Color" else result.part("w")
