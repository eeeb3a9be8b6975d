# SPDX-License-Identifier: GPL-3.0-or-later
"""Media by chance: everywhere, in a box about all, or inside things."""

from __future__ import annotations

import random
from typing import Any

import bpy

from tests.blender.build import CUBE, add_mesh, finish, new_material

SHARE = 0.35  # of scenes
VARYING = 0.5  # of media
GLOWING = 0.4  # of those inside things and boxes
TEXTURES = (
    ("TexNoise", 0),
    ("TexVoronoi", 0),
    ("TexWave", 0),
    ("TexGradient", 1),
    ("TexMagic", 1),
    ("TexBrick", 1),
)  # and which of their outputs is a number
KINDS = ("VolumePrincipled", "VolumeScatter", "VolumeAbsorption")


def fill(seed: int, scene: Any, materials: list[Any]) -> None:
    """Put a medium somewhere, in some scenes. Seeds stay the scenes that they were, but for it."""
    dice = random.Random(f"media {seed}")
    if dice.random() >= SHARE:
        return
    scene.cycles.volume_bounces = dice.choice([0, 0, 2, 8])
    differs, glows = random.Random(f"varying {seed}"), random.Random(f"glowing {seed}")
    where = dice.choice(["air", "box", "things", "things"])
    if where == "air":
        finish(tree := scene.world.node_tree, _made(dice, differs, tree, 0.1), "Volume")
    elif where == "box":
        material, tree = new_material("Fog")
        _link(dice, differs, glows, tree, 0.2)
        size = [dice.uniform(1.5, 12.0) for _ in "xyz"]
        add_mesh("Box", CUBE, location=(0, 0, 1.0), scale=size).data.materials.append(material)
    else:
        for material in materials:
            if dice.random() < 0.6:
                _link(dice, differs, glows, material.node_tree, 3.0)
                if dice.random() < 0.5:  # no surface
                    links = material.node_tree.links
                    for link in [x for x in links if x.to_socket.name == "Surface"]:
                        links.remove(link)


def _link(
    dice: random.Random,
    differs: random.Random,
    glows: random.Random,
    tree: bpy.types.NodeTree,
    most: float,
) -> None:
    node = _made(dice, differs, tree, most)
    if glows.random() < GLOWING:
        emission = tree.nodes.new("ShaderNodeEmission")
        emission.inputs["Strength"].default_value = glows.uniform(0.1, 1.0) * most
        emission.inputs["Color"].default_value = (*(glows.random() for _ in "rgb"), 1.0)
        if glows.random() < VARYING:
            _vary(glows, tree, emission, "Strength")
        both = tree.nodes.new("ShaderNodeAddShader")
        for part, socket in zip((node, emission), both.inputs, strict=True):
            tree.links.new(part.outputs[0], socket)
        node = both
    finish(tree, node, "Volume")


def _made(
    dice: random.Random, differs: random.Random, tree: bpy.types.NodeTree, most: float
) -> bpy.types.Node:
    kind = dice.choice(KINDS)
    node = tree.nodes.new(f"ShaderNode{kind}")
    node.inputs["Density"].default_value = dice.uniform(0.1, 1.0) * most
    node.inputs["Color"].default_value = (*(dice.uniform(0.2, 1.0) for _ in "rgb"), 1.0)
    if "Anisotropy" in node.inputs:
        node.inputs["Anisotropy"].default_value = dice.uniform(-0.7, 0.7)
    if "Absorption Color" in node.inputs and dice.random() < 0.5:
        node.inputs["Absorption Color"].default_value = (*(dice.random() for _ in "rgb"), 1.0)
    if differs.random() < VARYING:
        _vary(differs, tree, node, "Density")
    return node


def _vary(dice: random.Random, tree: bpy.types.NodeTree, node: bpy.types.Node, what: str) -> None:
    """Let an input differ from place to place, or the colour."""
    kind, output = dice.choice(TEXTURES)
    texture = tree.nodes.new(f"ShaderNode{kind}")
    if "Scale" in texture.inputs:
        texture.inputs["Scale"].default_value = dice.uniform(0.5, 4.0)
    if coordinate := dice.choice((None, "Generated", "Object")):
        places = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(places.outputs[coordinate], texture.inputs["Vector"])
    if dice.random() < 0.3:
        tree.links.new(texture.outputs["Color"], node.inputs["Color"])
        return
    ranged = tree.nodes.new("ShaderNodeMapRange")
    ranged.inputs["From Min"].default_value = dice.uniform(-0.2, 0.5)
    ranged.inputs["To Max"].default_value = 2.0 * node.inputs[what].default_value
    tree.links.new(texture.outputs[output], ranged.inputs["Value"])
    tree.links.new(ranged.outputs[0], node.inputs[what])
