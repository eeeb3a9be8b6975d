# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes tell of normals that a displacement bends, against Cycles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
import pytest

from .build import add_node
from .lobes import DIFFUSE
from .test_normals import Build, all_alike, ball, displacement

pytestmark = pytest.mark.blender


def told(kind: str, output: int | str, **properties: Any) -> Build:
    """What a node says of a displaced surface, one more than it, as some of it is negative."""

    def build(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
        displacement("OBJECT")(tree, shader)
        node = add_node(tree, f"ShaderNode{kind}")
        for name, value in properties.items():
            setattr(node, name, value)
        more = add_node(tree, "ShaderNodeVectorMath")
        more.inputs[1].default_value = (1.0, 1.0, 1.0)
        tree.links.new(node.outputs[output], more.inputs[0])
        tree.links.new(more.outputs[0], shader.inputs["Color"])

    return build


TOLD: Mapping[str, Build] = {
    "Fresnel": told("Fresnel", 0),
    "Layer Weight's Fresnel": told("LayerWeight", 0),
    "Layer Weight's Facing": told("LayerWeight", 1),
    "Normal": told("TexCoord", "Normal"),
    "Reflection": told("TexCoord", "Reflection"),
    "Geometry's Normal": told("NewGeometry", "Normal"),
    "Tangent": told("Tangent", 0, direction_type="RADIAL"),
}


def half_of_a_map(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
    """A normal of the world's, of half the strength: the other half is the surface's own."""
    told("NormalMap", 0, space="WORLD")(tree, shader)
    node = next(node for node in tree.nodes if node.type == "NORMAL_MAP")
    node.inputs["Strength"].default_value = 0.5
    node.inputs["Color"].default_value = (0.7, 0.35, 0.8, 1.0)


def shared(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
    """A coordinate that the displacement asks for, too, of the surface as it was."""
    displacement("OBJECT")(tree, shader)
    place = next(node for node in tree.nodes if node.type == "TEX_COORD")
    more = add_node(tree, "ShaderNodeVectorMath")
    more.inputs[1].default_value = (1.0, 1.0, 1.0)
    tree.links.new(place.outputs["Normal"], more.inputs[0])
    tree.links.new(more.outputs[0], shader.inputs["Color"])


def image_on_a_box(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
    """By the sides that the normal looks to."""
    displacement("OBJECT")(tree, shader)
    image = bpy.data.images.new("Colours", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.random.default_rng(1).uniform(0.1, 1.0, 64).astype(np.float32))
    node = add_node(tree, "ShaderNodeTexImage")
    node.image, node.projection, node.projection_blend = image, "BOX", 0.4
    place = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Object"], node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], shader.inputs["Color"])


def no_bevel(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
    """Of no radius: the normal as it is."""
    displacement("OBJECT")(tree, shader)
    node = add_node(tree, "ShaderNodeBevel", Radius=0.0)
    tree.links.new(node.outputs[0], shader.inputs["Normal"])


def test_as_cycles(export, cycles_mean, device) -> None:
    cases = {**TOLD, "half of a map": half_of_a_map, "a shared node": shared}
    cases["an image on a box"] = image_on_a_box
    all_alike(cases, ball, "emission", export, cycles_mean, device)


def test_a_bevel_of_no_radius(export, cycles_mean, device) -> None:
    all_alike({"bevel": no_bevel}, ball, DIFFUSE, export, cycles_mean, device)
