# SPDX-License-Identifier: GPL-3.0-or-later
"""Hue/Saturation/Value, Brightness/Contrast, Gamma, Invert, RGB to BW, Separate and Combine
Color."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..hsv import CONVERSIONS, hue_saturation
from ..links import Scope
from ..programs import Value, math, mix
from ..working_space import luminance
from .vectors import Numbers, combined


def read_hue_saturation(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Hue/Saturation/Value."""
    names = {"hue": "Hue", "saturation": "Saturation", "value": "Value", "factor": "Factor"}
    change = {name: graph.value(named(node, of), scope) for name, of in names.items()}
    colour = graph.input(node, "Color", scope)

    def fold(change: Numbers, colour: Numbers) -> Numbers:
        return hue_saturation(change, colour[:3])

    return graph.program.emit("hue_saturation", fold, colour=colour, **change)


def read_contrast(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Brightness/Contrast."""
    colour, bright, contrast = (graph.value(socket, scope) for socket in node.inputs)
    found = math("MULTIPLY_ADD", colour, 1.0 + contrast, bright - 0.5 * contrast)
    return math("MAXIMUM", found, 0.0)


def read_gamma(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Gamma."""
    return math("GAMMA", *(graph.value(socket, scope) for socket in node.inputs))


def read_invert(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Invert Color."""
    factor, colour = (graph.value(socket, scope) for socket in node.inputs)
    return mix(colour, 1.0 - colour, factor)


def read_grey(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read RGB to BW."""
    return luminance(graph.value(node.inputs[0], scope))


def read_separate(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Separate Color."""
    colour = graph.value(node.inputs[0], scope)
    if node.mode != "RGB":
        colour = converted_colour(graph, colour, f"RGB to {node.mode}")
    return colour.part("xyz"[list(node.outputs).index(output)])


def read_combine(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Combine Color."""
    colour = combined(graph, *(graph.value(socket, scope) for socket in node.inputs))
    return colour if node.mode == "RGB" else converted_colour(graph, colour, f"{node.mode} to RGB")


def converted_colour(graph: Graph, colour: Value, conversion: str) -> Value:
    """A colour after one of CONVERSIONS."""
    number, function = CONVERSIONS[conversion]

    def fold(colour: Numbers, _: Numbers) -> Numbers:
        return function(colour[:3])

    return graph.program.emit("hsv", fold, colour=colour, conversion=Value.of(number))


def named(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket:
    """An input by its name, or what it was called before Blender 5.0."""
    socket = node.inputs.get(name)
    return node.inputs["Fac"] if socket is None and name == "Factor" else socket
