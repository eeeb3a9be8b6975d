# SPDX-License-Identifier: GPL-3.0-or-later
"""Voronoi Texture."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .procedural import choice, numbers, place, whole_place

# The numbers of glsl/lib/voronoi.glsl; Minkowski's metric is an instruction of its own.
METRICS = {"EUCLIDEAN": 0, "MANHATTAN": 1, "CHEBYCHEV": 2}
# The numbers of glsl/nodes/voronoi_minkowski.glsl.
FEATURES = {"F1": 0, "F2": 1, "SMOOTH_F1": 2}
LAYERS = ("Scale", "Detail", "Roughness", "Lacunarity", "Randomness")


def read(graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope) -> Value:
    """Read an output. Those that a feature does not have are 0."""
    if bpy.app.version < (5, 0) and node.voronoi_dimensions != "1D":
        what = "its cells lie where Blender 5.0 has them"  # by whole numbers' hash
        graph.notes.approximated(graph.owner, node.bl_label, what)
    if node.feature == "N_SPHERE_RADIUS":
        return _radius(graph, node, scope) if output.identifier == "Radius" else Value.of(0.0)
    if output.identifier == "Radius":
        return Value.of(0.0)
    if node.feature == "DISTANCE_TO_EDGE":
        return _edge(graph, node, scope) if output.identifier == "Distance" else Value.of(0.0)
    result = _points(graph, node, scope, output.identifier in ("Position", "W"))
    return result if output.identifier in ("Color", "Position") else result.part("w")


def _points(graph: Graph, node: bpy.types.Node, scope: Scope, placed: bool) -> Value:
    """F1, F2 or Smooth F1: the colour and the distance, or with `placed` the position and W."""
    dimensions, feature = node.voronoi_dimensions, node.feature
    operands = numbers(graph, node, scope, *LAYERS)
    operands |= {"normalized": choice(node.normalize), "placed": choice(placed)}
    smoothness = graph.input(node, "Smoothness", scope, 0.0)
    if feature == "SMOOTH_F1" and smoothness.is_just(0.0):
        feature = "F1"
    if dimensions == "1D":
        operands |= place(graph, node, scope, dimensions)
    elif node.distance == "MINKOWSKI":
        operands |= whole_place(graph, node, scope, dimensions)
        return graph.program.emit(
            "voronoi_minkowski",
            **operands,
            exponent=graph.input(node, "Exponent", scope),
            feature=choice(FEATURES[feature]),
            smoothness=smoothness,
            dimensions=choice(int(dimensions[0])),
        )
    else:
        operands |= place(graph, node, scope, dimensions)
        operands["metric"] = choice(METRICS[node.distance])
    if feature == "SMOOTH_F1":
        kind = f"voronoi_smooth_{dimensions.lower()}"
        return graph.program.emit(kind, **operands, smoothness=smoothness)
    kind = f"voronoi_{dimensions.lower()}"
    return graph.program.emit(kind, **operands, second=choice(feature == "F2"))


def _edge(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    dimensions = node.voronoi_dimensions
    return graph.program.emit(
        f"voronoi_edge_{dimensions.lower()}",
        **place(graph, node, scope, dimensions),
        **numbers(graph, node, scope, *LAYERS),
        normalized=choice(node.normalize),
    )


def _radius(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    dimensions = node.voronoi_dimensions
    return graph.program.emit(
        "voronoi_radius",
        **whole_place(graph, node, scope, dimensions),
        **numbers(graph, node, scope, "Scale", "Randomness"),
        dimensions=choice(int(dimensions[0])),
    )
