# SPDX-License-Identifier: GPL-3.0-or-later
"""Graphs of worlds: what is the same in every direction, and what nodes have for their outputs."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from addon.photon.scene import FOUND_BY

from .build import add_node, finish, new_world

pytestmark = pytest.mark.blender
BACKGROUND = "ShaderNodeBackground"


def camera_ray(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    return tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"]


def divided(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    one_more = add_node(tree, "ShaderNodeMath", Value=camera_ray(tree))
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = "DIVIDE"
    node.inputs[0].default_value = 2.0
    one_more.inputs[1].default_value = 1.0
    tree.links.new(one_more.outputs[0], node.inputs[1])
    return node.outputs[0]


def mapped(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    node = add_node(tree, "ShaderNodeMapRange", Value=camera_ray(tree), To_Min=2.0, To_Max=1.0)
    return node.outputs[0]


def clamped(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    halves = add_node(tree, "ShaderNodeMath", Value=camera_ray(tree))
    halves.operation = "MULTIPLY_ADD"
    halves.inputs[1].default_value, halves.inputs[2].default_value = -5.0, 2.0
    node = add_node(tree, "ShaderNodeClamp", Value=halves.outputs[0], Min=1.0, Max=3.0)
    return node.outputs[0]


def mixed(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    node = add_node(tree, "ShaderNodeMix", Factor=camera_ray(tree))
    node.inputs[2].default_value, node.inputs[3].default_value = 2.0, 1.0
    return node.outputs[0]


@pytest.mark.parametrize("strength", (divided, mapped, clamped, mixed))
def test_strengths_by_light_path(
    scene: bpy.types.Scene,
    export: Callable,
    strength: Callable[[bpy.types.NodeTree], bpy.types.NodeSocket],
) -> None:
    """1 to the camera and 2 to others, through nodes of all kinds."""
    tree = new_world(scene)
    colour = (0.5, 0.25, 0.125, 1)
    finish(tree, add_node(tree, BACKGROUND, Color=colour, Strength=strength(tree)))
    exported, report = export()
    found = {light.found_by: light.power for light in exported.lights}
    assert found == {
        ("camera",): pytest.approx(colour[:3]),
        FOUND_BY[1:]: pytest.approx(np.multiply(2.0, colour[:3])),
    }
    assert not report.of("approximated") and not report.of("ignored")


def test_a_ramp_by_light_path(scene: bpy.types.Scene, export: Callable) -> None:
    """Of a colour for each, and no image."""
    tree = new_world(scene)
    ramp = add_node(tree, "ShaderNodeValToRGB", Fac=camera_ray(tree))
    for element, colour in zip(ramp.color_ramp.elements, ((1, 0, 0, 1), (0, 0, 1, 1)), strict=True):
        element.color = colour
    finish(tree, add_node(tree, BACKGROUND, Color=ramp.outputs[0]))
    exported, _ = export()
    found = {light.found_by: light.power for light in exported.lights}
    assert found == {("camera",): (0.0, 0.0, 1.0), FOUND_BY[1:]: (1.0, 0.0, 0.0)}
    assert not exported.images


def test_images_by_light_path(scene: bpy.types.Scene, export: Callable) -> None:
    """Of a checker, which the camera alone sees squared: an image for each, and no more."""
    tree = new_world(scene)
    checker = add_node(tree, "ShaderNodeTexChecker", Color1=(0.5, 0.5, 0.5, 1), Color2=(0, 0, 0, 1))
    power = add_node(tree, "ShaderNodeMath", Value=camera_ray(tree))
    power.inputs[1].default_value = 1.0
    root = add_node(tree, "ShaderNodeGamma", Color=checker.outputs[0], Gamma=power.outputs[0])
    finish(tree, add_node(tree, BACKGROUND, Color=root.outputs[0]))
    exported, report = export()
    found = {x.found_by: exported.images[int(x.parameters["image"])] for x in exported.lights}
    most = {who: float(image.pixels.max()) for who, image in found.items()}
    assert most == {("camera",): pytest.approx(0.25), FOUND_BY[1:]: pytest.approx(0.5)}
    (entry,) = (e for e in report.of("approximated") if "World" in e.object)
    assert "Gamma" in entry.feature and "one for each" in entry.detail
    assert len(exported.images) == 2


def test_what_nodes_have_for_their_outputs(scene: bpy.types.Scene, export: Callable) -> None:
    """A colour, a number and a direction, which Blender evaluates with what differs."""
    tree = new_world(scene)
    checker = tree.nodes.new("ShaderNodeTexChecker")
    value, colour, normal = (tree.nodes.new(f"ShaderNode{x}") for x in ("Value", "RGB", "Normal"))
    value.outputs[0].default_value = 2.0
    colour.outputs[0].default_value = (0.25, 0.5, 0.75, 1.0)
    normal.outputs[0].default_value = (1.0, 0.0, 0.0)
    finish(tree, add_node(tree, BACKGROUND, Color=checker.outputs[0]))
    tree.links.new(value.outputs[0], checker.inputs["Scale"])
    tree.links.new(colour.outputs[0], checker.inputs["Color1"])
    tree.links.new(normal.outputs["Normal"], checker.inputs["Color2"])
    (image,) = export()[0].images
    found = np.unique(image.pixels.reshape(-1, 3).round(3), axis=0)
    ends = {tuple(row) for row in found.tolist()}
    assert {(0.25, 0.5, 0.75), (1.0, 0.0, 0.0)} <= ends
    share = (np.abs(image.pixels - (1.0, 0.0, 0.0)).max(axis=-1) < 1e-3).mean()
    assert 0.3 < share < 0.7
