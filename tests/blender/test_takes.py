# SPDX-License-Identifier: GPL-3.0-or-later
"""Negative lamps, light groups and shadow catchers against Cycles."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from tests.measure import render
from tests.regression.blocks import block_means
from tests.regression.cycles import prepare

from .build import (
    add_light,
    add_mesh,
    add_node,
    add_object,
    finish,
    new_material,
    nodes_of,
    shader_material,
)

pytestmark = pytest.mark.blender

SIZE = 64
CUBE = (
    [(x, y, z) for x in (-0.6, 0.6) for y in (-0.6, 0.6) for z in (-0.6, 0.6)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)
FLOOR = ([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [(0, 1, 2, 3)])
BACK = ([(-3, 3, 0), (3, 3, 0), (3, 3, 4), (-3, 3, 4)], [(0, 1, 2, 3)])
PLATE = ([(0, 0, 0), (1, 0, 0), (1, 0, 1.5), (0, 0, 1.5)], [(0, 1, 2, 3)])


@pytest.fixture
def table(scene: bpy.types.Scene) -> bpy.types.Scene:
    """A cube before a wall, lit from the left by a bulb, and faintly by the world."""
    render = scene.render
    render.resolution_x = render.resolution_y = SIZE
    add("Floor", FLOOR, "ShaderNodeBsdfDiffuse", (0.7, 0.7, 0.7))
    add("Back", BACK, "ShaderNodeBsdfDiffuse", (0.3, 0.5, 0.8))
    cube = add("Cube", CUBE, "ShaderNodeBsdfDiffuse", (0.8, 0.2, 0.1), location=(-0.6, 0.5, 0.6))
    cube.rotation_euler = 0.0, 0.0, 0.5
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 34
    where = {"location": (0, -4.5, 2.5), "rotation_euler": (1.12, 0, 0)}
    scene.camera = add_object("Camera", camera, **where)
    add_light("Key", "POINT", energy=300, shadow_soft_size=0.2, location=(-1.5, -1.5, 3.5))
    world = scene.world = bpy.data.worlds.new("World")
    background = next(node for node in nodes_of(world).nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.1, 0.15, 0.3, 1.0)
    return scene


def add(name: str, shape: Any, kind: str, colour: Any, **properties: Any) -> bpy.types.Object:
    obj = add_mesh(name, shape, **properties)
    obj.data.materials.append(shader_material(kind, name, Color=(*colour, 1.0)))
    return obj


def emissive(name: str, **properties: Any) -> bpy.types.Object:
    obj = add(name, PLATE, "ShaderNodeEmission", (0.2, 1.0, 0.3), **properties)
    emission = obj.data.materials[0].node_tree.nodes
    next(x for x in emission if x.type == "EMISSION").inputs["Strength"].default_value = 3.0
    return obj


def by_cycles(samples: int, is_transparent: bool = False) -> dict[str, NDArray[Any]]:
    """Passes by name, (h, w, 3 or 4), row 0 at the bottom."""
    scene = bpy.context.scene
    prepare(scene, samples, seed=1)
    scene.cycles.transparent_max_bounces = 8
    scene.render.film_transparent = is_transparent
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    found: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cycles.exr"
        bpy.ops.render.render()
        bpy.data.images["Render Result"].save_render(str(path), scene=scene)
        for part in OpenEXR.File(str(path), separate_channels=True).parts:
            for name, channel in part.channels.items():
                _, entry, component = name.rsplit(".", 2)
                found.setdefault(entry, {})[component] = np.array(channel.pixels[::-1])
    return {
        name: np.stack([of_one[x] for x in "RGBA" if x in of_one], axis=-1)
        for name, of_one in found.items()
        if "R" in of_one
    }


def both(
    export: Any, device: Any, samples: int, is_transparent: bool = False
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Our images and Cycles'; nothing is approximated."""
    exported, report = export()
    assert not [entry for entry in report.entries if entry.status != "exact"]
    size: dict[str, Any] = {"width": SIZE, "height": SIZE, "passes": 32, "photons": 30000}
    ours = render(device, exported, **size, radius_decay=2 / 3, transparent=is_transparent)
    return ours, by_cycles(samples, is_transparent)


def check_blocks(ours: Any, theirs: Any, name: str, dark: float = 0.1) -> None:
    """8x8 blocks' relative differences: the median 1 %, the 95th percentile 3 %; what is darker
    than a share of the mean by that."""
    a, b = block_means(ours[..., :3]), block_means(theirs[..., :3])
    off = np.abs(a - b) / np.maximum(np.abs(b), dark * np.abs(b).mean())
    assert np.median(off) < 0.01 and np.percentile(off, 95) < 0.03, (
        name,
        np.sort(off.ravel())[-9:],
    )


def test_negative_lamps(table, export, device) -> None:
    """They take away; one of mixed signs does both."""
    table.world = None
    bpy.data.lights["Key"].energy = 400
    add_light("Hole", "SPOT", energy=-150, shadow_soft_size=0.1, location=(1, -1, 3), spot_size=1.5)
    tint = add_light("Tint", "AREA", energy=30, size=1.0, location=(1.5, 0.5, 2.0)).data
    tree = nodes_of(tint)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    both_signs = add_node(tree, "ShaderNodeCombineXYZ", X=1.0, Y=-0.5, Z=0.2)
    tree.links.new(both_signs.outputs[0], emission.inputs["Color"])
    ours, theirs = both(export, device, 256)
    assert theirs["Combined"][..., :3].min() < -0.01
    # Where both signs nearly cancel, their noise does not.
    check_blocks(ours["Combined"], theirs["Combined"], "Combined", dark=1.0)


def test_light_groups(table, export, device) -> None:
    """Each as Cycles has it, by lamps, an emissive panel and the world; one lamp is in none."""
    layer = bpy.context.view_layer
    for name in ("Key", "Fill", "Sky"):
        layer.lightgroups.add(name=name)
    bpy.data.objects["Key"].lightgroup = "Key"
    fill = add_light("Fill", "AREA", energy=100, size=1.0, location=(2.5, -1, 2.5))
    fill.rotation_euler, fill.lightgroup = (0.3, 0.9, 0), "Fill"
    emissive("Panel", location=(1.0, 1.5, 0.2)).lightgroup = "Fill"
    rim = add_light("Rim", "POINT", energy=40, color=(1, 0.3, 0.1), location=(2, 2, 2))
    rim.lightgroup = "Elsewhere"  # the view layer has no such group
    table.world.lightgroup = "Sky"
    ours, theirs = both(export, device, 512)
    names = {f"Combined_{name}" for name in ("Key", "Fill", "Sky")}
    assert names < ours.keys() and names < theirs.keys()
    for name in (*names, "Combined"):
        check_blocks(ours[name], theirs[name], name)


@pytest.mark.parametrize("is_transparent", [True, pytest.param(False, marks=pytest.mark.thorough)])
def test_shadow_catchers(table, export, device, is_transparent) -> None:
    """Floor and wall catch; before them a clear plate, an emissive one, and an area light. So does
    what stands before the cube."""
    add("Sheet", PLATE, "ShaderNodeBsdfDiffuse", (0.7, 0.7, 0.7), location=(-0.9, -2.0, 0))
    for name in ("Floor", "Back", "Sheet"):
        bpy.data.objects[name].is_shadow_catcher = True
    add("Clear", PLATE, "ShaderNodeBsdfTransparent", (0.5, 0.7, 0.5), location=(0.3, -0.8, 0))
    emissive("Panel", location=(1.2, 2.0, 0.2))
    add_light("Fill", "AREA", energy=60, size=0.7, location=(1.5, 2, 2.5), rotation_euler=(1, 0, 0))
    ours, theirs = both(export, device, 256, is_transparent)
    a, b = block_means(ours["Combined"]), block_means(theirs["Combined"])
    assert np.abs(a - b)[..., 3].max() < 0.02
    if is_transparent:
        assert (
            b[..., 3].min() < 0.02 and ((b[..., 3] > 0.1) & (b[..., :3].max(axis=-1) < 0.02)).any()
        )
    off = np.abs(a - b)[..., :3] / np.maximum(b[..., :3], 0.1)
    assert np.median(off) < 0.01 and np.percentile(off, 95) < 0.03, np.sort(off.ravel())[-9:]


@pytest.mark.thorough("0.4")
@pytest.mark.parametrize("share", [0.0, 0.4])
def test_holdouts_let_through_what_is_transparent(table, export, device, share) -> None:
    """An object that is held out, diffuse to such a share: behind the rest is what is there."""
    material, tree = new_material()
    mixed = add_node(tree, "ShaderNodeMixShader")
    mixed.inputs[0].default_value = share
    clear = add_node(tree, "ShaderNodeBsdfTransparent", Color=(0.5, 0.8, 0.2, 1.0))
    for socket, node in ((1, clear), (2, add_node(tree, "ShaderNodeBsdfDiffuse"))):
        tree.links.new(node.outputs[0], mixed.inputs[socket])
    finish(tree, mixed)
    plate = add_mesh("Plate", PLATE, location=(0.2, -0.8, 0), is_holdout=True)
    plate.data.materials.append(material)
    ours, theirs = both(export, device, 256, is_transparent=True)
    check_blocks(ours["Combined"], theirs["Combined"], "Combined")
    a, b = block_means(ours["Combined"])[..., 3], block_means(theirs["Combined"])[..., 3]
    assert np.abs(a - b).max() < 0.02 and b.min() < 0.7
