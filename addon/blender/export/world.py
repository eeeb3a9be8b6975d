# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the world as light of one radiance, and note what the scene asks of it in vain."""

from __future__ import annotations

import bpy
import numpy as np

from ...photon.scene import Light, world_light
from .materials import has_nodes
from .nodes import Colour, Graph, Scope, colour_of, source, value_of
from .report import Notes

BLACK = (0.0, 0.0, 0.0)


def export_world(world: bpy.types.World | None, notes: Notes) -> tuple[Light, ...]:
    """Return the lights that the world is."""
    if world is None:
        return ()
    owner = f"World '{world.name}'"
    if has_nodes(world):
        graph = Graph(world.node_tree, owner, notes)
        output = graph.output("OUTPUT_WORLD")
        if output is not None and output.inputs["Volume"].is_linked:
            notes.ignored(owner, "Volume", "not rendered")
        node, scope = graph.surface("OUTPUT_WORLD")
        radiance = np.array(_radiance(graph, node, scope))
    else:
        radiance = np.array(world.color[:], np.float64)
    valid = np.where(np.isfinite(radiance), radiance, 0.0).clip(0.0)
    if not np.array_equal(valid, radiance):
        notes.approximated(owner, "Colour", "negative or not finite: clamped to 0")
    if not notes.mention(owner):
        notes.exact(owner, "Background")
    r, g, b = (float(channel) for channel in valid)
    return (world_light(world.name, (r, g, b)),) if valid.any() else ()


def _radiance(graph: Graph, node: bpy.types.Node | None, scope: Scope) -> Colour:
    if node is None:
        return BLACK
    if node.type in ("BACKGROUND", "EMISSION"):
        strength = value_of(graph, node.inputs["Strength"], scope)
        r, g, b = colour_of(graph, node.inputs["Color"], scope)
        return r * strength, g * strength, b * strength
    if node.type == "MIX_SHADER":
        factor = _mix_factor(graph, node, scope)
        first, second = (_radiance(graph, *_input(node, index, scope)) for index in (1, 2))
        r, g, b = ((1.0 - factor) * a + factor * b for a, b in zip(first, second, strict=True))
        return r, g, b
    if node.type == "ADD_SHADER":
        first, second = (_radiance(graph, *_input(node, index, scope)) for index in (0, 1))
        r, g, b = (a + b for a, b in zip(first, second, strict=True))
        return r, g, b
    graph.notes.ignored(graph.owner, f"{node.bl_label} '{node.name}'", "black is used")
    return BLACK


def _mix_factor(graph: Graph, node: bpy.types.Node, scope: Scope) -> float:
    feeding, end, _ = source(node.inputs[0], scope)
    # The customary switch between what the camera sees and what lights the scene.
    if feeding is not None and feeding.type == "LIGHT_PATH":
        graph.notes.approximated(graph.owner, "Light Path", "the camera's side is used everywhere")
        return 1.0 if end.name == "Is Camera Ray" else 0.0
    return min(max(value_of(graph, node.inputs[0], scope), 0.0), 1.0)


def _input(node: bpy.types.Node, index: int, scope: Scope) -> tuple[bpy.types.Node | None, Scope]:
    found, _, inner = source(node.inputs[index], scope)
    return found, inner


def note_scene(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, notes: Notes) -> None:
    """Write down scene-wide features that are not simulated."""
    name = f"Scene '{scene.name}'"
    cycles = getattr(scene, "cycles", None)
    for kind in ("direct", "indirect"):
        most = getattr(cycles, f"sample_clamp_{kind}", 0.0)
        if most > 0.0:
            detail = f"what is brighter than {most:g} stays so"
            notes.ignored(name, f"Clamp {kind.capitalize()}", detail)
    if scene.render.use_motion_blur:
        notes.approximated(name, "Motion Blur", "only the camera moves within a frame")
        if getattr(cycles, "rolling_shutter_type", "NONE") != "NONE":
            notes.ignored(name, "Rolling Shutter", "all rows are exposed at once")
    if getattr(getattr(scene, "eevee", None), "use_overscan", False):
        notes.ignored(name, "Overscan", "it is EEVEE's")
    if scene.render.use_freestyle and view_layer.use_freestyle:
        notes.ignored(name, "Freestyle", "no lines are drawn")
