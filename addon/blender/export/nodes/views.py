# SPDX-License-Identifier: GPL-3.0-or-later
"""What differs with the viewer: Fresnel, Layer Weight, Camera Data, Light Path, Light Falloff."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope, is_given
from ..programs import ONE, ZERO, Value, math
from .attributes import in_camera
from .mapping import normalized
from .vectors import vector

# The numbers of glsl/nodes/light_path.glsl.
PATHS = {
    "Is Camera Ray": 0,
    "Is Shadow Ray": 1,
    "Is Diffuse Ray": 2,
    "Is Glossy Ray": 3,
    "Ray Length": 4,
    "Ray Depth": 5,
}
NEVER = {"Is Volume Scatter Ray", "Portal Depth"}  # what no ray is here
# Powers of the distance in Light Falloff's outputs.
FALLOFFS = {"Quadratic": 0, "Linear": 1, "Constant": 2}


def read_fresnel(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Fresnel."""
    return reflected(graph, node, scope, graph.input(node, "IOR", scope)).part("x")


def read_layer_weight(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Layer Weight."""
    blend = graph.input(node, "Blend", scope)
    if output.name == "Fresnel":
        return reflected(graph, node, scope, 1.0 / math("MAXIMUM", 1.0 - blend, 1e-5)).part("x")
    cosine = reflected(graph, node, scope, ONE).part("w")
    blend = blend.clamp(0.0, 1.0 - 1e-5)
    is_high = math("GREATER_THAN", blend, 0.5)
    low = 2.0 * blend
    return 1.0 - math("POWER", cosine, low + is_high * (0.5 / (1.0 - blend) - low))


def reflected(graph: Graph, node: bpy.types.Node, scope: Scope, ior: Value) -> Value:
    """The share that is reflected, and in w the cosine."""
    normal = node.inputs["Normal"]
    given = is_given(normal, scope)
    at = graph.value(normal, scope) if given else graph.displaced
    told = Value.of(float(at is not None))
    return graph.program.emit("fresnel", ior=ior, normal=at or ZERO, given=told)


def read_camera(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Camera Data."""
    at = in_camera(graph)
    match output.name:
        case "View Vector":
            return normalized(graph, at)
        case "View Z Depth":
            return at.part("z")
    return vector(graph, "LENGTH", at, ZERO, ZERO)


def read_light_path(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Light Path."""
    which = PATHS.get(output.name)
    if which is None:
        if output.name not in NEVER:
            graph.notes.approximated(graph.owner, f"Light Path's {output.name}", "0 is used")
        return ZERO
    if output.name == "Is Shadow Ray":
        what = "photons are taken for diffuse rays"
        graph.notes.approximated(graph.owner, "Light Path's Is Shadow Ray", what)
    return graph.program.emit("light_path", which=Value.of(which))


def read_light_falloff(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Light Falloff of a surface: its strength by the length of the ray that meets it; what
    emits lights as 1 m away."""
    strength, smooth = (graph.input(node, name, scope) for name in ("Strength", "Smooth"))
    power = FALLOFFS[output.name]
    is_sharp = smooth.is_constant and not smooth.number > 0.0
    if is_sharp and power == 0:
        return strength
    of_light = graph.program.emit("light_path", which=Value.of(PATHS["Is Diffuse Ray"]))
    length = graph.program.emit("light_path", which=Value.of(PATHS["Ray Length"]))
    length = (length + of_light * (1.0 - length)).part("x")
    for _ in range(power):
        strength = strength * length
    if is_sharp:
        return strength
    square = length * length
    return strength * (square / (math("MAXIMUM", smooth, 0.0) + square))
