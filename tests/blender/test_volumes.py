# SPDX-License-Identifier: GPL-3.0-or-later
"""Media as Cycles has them: inside meshes and in the world."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from tests.measure import render
from tests.scenes import icosphere

from .build import add_light, add_mesh, add_node, new_material, new_world, shader_material
from .lobes import DIFFUSE

pytestmark = pytest.mark.blender

SIZE = 48
CUBE = (
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)
BALL = tuple(x.tolist() for x in icosphere(3))


def fill(tree: bpy.types.NodeTree, kind: str, **inputs: Any) -> bpy.types.Node:
    """Link a node of a kind to a tree's Volume."""
    volume = add_node(tree, kind, **inputs)
    output = next(node for node in tree.nodes if node.type.startswith("OUTPUT"))
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    return volume


def fog(kind: str = "ShaderNodeVolumePrincipled", **inputs: Any) -> bpy.types.Material:
    """A material without a surface."""
    material, tree = new_material("Fog")
    fill(tree, kind, **inputs)
    return material


def room() -> None:
    """A floor, a wall and a box on it, and a spot."""
    grey = shader_material(DIFFUSE, Color=(0.8, 0.6, 0.4, 1))
    add_mesh("Floor", scale=(3, 3, 1)).data.materials.append(grey)
    wall = add_mesh(
        "Wall", location=(0, 1.6, 1), rotation_euler=(math.pi / 2, 0, 0), scale=(3,) * 3
    )
    wall.data.materials.append(grey)
    add_light("Spot", "SPOT", location=(-1.0, -0.5, 2.0), energy=80.0, spot_size=0.9)


def around(scene: bpy.types.Scene) -> None:
    """Fog in a box that the camera is outside of."""
    box = add_mesh("Box", CUBE, location=(0, 0, 0.9), scale=(1.4, 1.4, 0.85))
    box.data.materials.append(fog(Density=0.6, Color=(0.9, 0.6, 0.3, 1), Anisotropy=0.4))


def about_all(scene: bpy.types.Scene) -> None:
    """The camera and the lamp are inside."""
    box = add_mesh("Box", CUBE, location=(0, 0, 0), scale=(12, 12, 12))
    scatter = fog("ShaderNodeVolumeScatter", Color=(0.5, 0.8, 0.9, 1), Density=0.15, Anisotropy=0.3)
    box.data.materials.append(scatter)


def in_world(scene: bpy.types.Scene) -> None:
    fill(new_world(scene), "ShaderNodeVolumePrincipled", Density=0.12, Color=(0.7, 0.8, 0.9, 1))


def nested(scene: bpy.types.Scene) -> None:
    """A ball of something denser in it, and glass that holds a medium."""
    around(scene)
    ball = add_mesh("Ball", BALL, location=(0.3, -0.2, 0.7), scale=(0.4,) * 3)
    ball.data.materials.append(fog(Density=5.0, Color=(0.2, 0.5, 0.9, 1)))


CASES = (around, about_all, in_world, nested)


@pytest.mark.parametrize("bounces", [0, 3])
@pytest.mark.parametrize("place", CASES)
def test_pictures(
    scene: bpy.types.Scene,
    export: Callable[..., Any],
    cycles_mean: Callable[..., Any],
    device: Any,
    place: Callable[..., None],
    bounces: int,
) -> None:
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    room()
    place(scene)
    scene.cycles.volume_bounces = bounces
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    theirs = cycles_mean(256, 1)[..., :3]
    exported, report = export()
    settings = {"width": SIZE, "height": SIZE, "passes": 96, "photons": 30000, "mirror_depth": 12}
    ours = render(device, exported, volume_bounces=bounces, **settings)["Combined"][..., :3]
    np.savez(f"/tmp/vol_{place.__name__}_{bounces}.npz", ours=ours, theirs=theirs)
    blocks = [x.reshape(SIZE // 8, 8, SIZE // 8, 8, 3).mean(axis=(1, 3)) for x in (ours, theirs)]
    off = np.abs(blocks[0] - blocks[1]) / np.maximum(blocks[1], 0.1 * theirs.mean())
    print(
        place.__name__,
        bounces,
        ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1)),
        np.median(off),
        off.max(),
    )
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.01)
    assert np.median(off) < 0.02
