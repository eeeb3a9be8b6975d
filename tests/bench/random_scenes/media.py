# SPDX-License-Identifier: GPL-3.0-or-later
"""Media by chance: everywhere, in a box about all, or inside things."""

from __future__ import annotations

import random
from typing import Any

import bpy

from tests.blender.build import CUBE, add_mesh, finish, new_material

SHARE = 0.35  # of scenes
KINDS = ("VolumePrincipled", "VolumeScatter", "VolumeAbsorption")


def fill(seed: int, scene: Any, materials: list[Any]) -> None:
    """Put a medium somewhere, in some scenes. Seeds stay the scenes that they were, but for it."""
    dice = random.Random(f"media {seed}")
    if dice.random() >= SHARE:
        return
    scene.cycles.volume_bounces = dice.choice([0, 0, 2, 8])
    where = dice.choice(["air", "box", "things", "things"])
    if where == "air":
        _link(dice, scene.world.node_tree, 0.1)
    elif where == "box":
        material, tree = new_material("Fog")
        _link(dice, tree, 0.2)
        size = [dice.uniform(1.5, 12.0) for _ in "xyz"]
        add_mesh("Box", CUBE, location=(0, 0, 1.0), scale=size).data.materials.append(material)
    else:
        for material in materials:
            if dice.random() < 0.6:
                _link(dice, material.node_tree, 3.0)
                if dice.random() < 0.5:  # no surface
                    links = material.node_tree.links
                    for link in [x for x in links if x.to_socket.name == "Surface"]:
                        links.remove(link)


def _link(dice: random.Random, tree: bpy.types.NodeTree, most: float) -> None:
    kind = dice.choice(KINDS)
    node = tree.nodes.new(f"ShaderNode{kind}")
    node.inputs["Density"].default_value = dice.uniform(0.1, 1.0) * most
    node.inputs["Color"].default_value = (*(dice.uniform(0.2, 1.0) for _ in "rgb"), 1.0)
    if "Anisotropy" in node.inputs:
        node.inputs["Anisotropy"].default_value = dice.uniform(-0.7, 0.7)
    if "Absorption Color" in node.inputs and dice.random() < 0.5:
        node.inputs["Absorption Color"].default_value = (*(dice.random() for _ in "rgb"), 1.0)
    finish(tree, node, "Volume")
