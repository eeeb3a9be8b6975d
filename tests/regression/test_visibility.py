# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray visibility, holdouts and limited lights against Cycles: a box and a mirror in half a room.

The lamp has no size and no photon that the mirror scattered is seen: Cycles finds no such paths.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from addon.blender.export import snapshot
from addon.streams import Device
from tests.blender.build import CUBE, add_light, add_mesh, add_object, shader_material
from tests.measure import render

from .cycles import prepare

pytestmark = pytest.mark.blender

SIZE, BLOCK = 24, 4  # [px]
WALLS = {
    "Floor": [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)],
    "Back": [(-3, 3, 0), (3, 3, 0), (3, 3, 5), (-3, 3, 5)],
    "Left": [(-3, -3, 0), (-3, 3, 0), (-3, 3, 5), (-3, -3, 5)],
    "Mirror": [(2.9, -2.5, 0.1), (2.9, 2.9, 0.1), (2.5, 2.9, 4.0), (2.5, -2.5, 4.0)],
}


@pytest.fixture
def scene() -> bpy.types.Scene:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    diffuse, glossy = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy"
    white = shader_material(diffuse, "White", Color=(0.7, 0.7, 0.7, 1.0))
    mirror = shader_material(glossy, "Mirror", Color=(0.9, 0.9, 0.9, 1.0), Roughness=0.0)
    for name, corners in WALLS.items():
        wall = add_mesh(name, (corners, [(0, 1, 2, 3)]))
        wall.data.materials.append(mirror if name == "Mirror" else white)
    bpy.data.objects["Mirror"].visible_diffuse = False
    box = add_mesh("Box", CUBE, location=(-0.2, 0.6, 1.2), rotation_euler=(0.3, 0.2, 0.5))
    box.data.materials.append(shader_material(diffuse, "Red", Color=(0.8, 0.1, 0.1, 1.0)))
    add_light("Lamp", "POINT", energy=400.0, shadow_soft_size=0.0, location=(-1.5, -1.5, 4.2))
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 34
    scene.camera = add_object("Camera", camera, location=(0, -9, 2.6), rotation_euler=(1.536, 0, 0))
    return scene


def hide(name: str, *rays: str) -> Callable[[], None]:
    def change() -> None:
        for ray in rays:
            setattr(bpy.data.objects[name], f"visible_{ray}", False)

    return change


def max_bounces() -> None:
    bpy.data.objects.remove(bpy.data.objects["Mirror"])
    bpy.data.lights["Lamp"].cycles.max_bounces = 1


def holdout_shader() -> None:
    bpy.data.objects["Box"].data.materials[0] = shader_material("ShaderNodeHoldout", "Hole")


def emissive(**flags: bool) -> Callable[[], None]:
    """The box is emissive, beside the lamp."""

    def change() -> None:
        box = bpy.data.objects["Box"]
        material = shader_material(
            "ShaderNodeEmission", "Emissive", Color=(0.3, 1.0, 0.4, 1.0), Strength=2
        )
        box.data.materials[0] = material
        for flag, value in flags.items():
            setattr(box, flag, value)

    return change


def indirect_only() -> None:
    """An emissive box in such a collection, and a mirror."""
    emissive()()
    scene, inside = bpy.context.scene, bpy.data.collections.new("Inside")
    scene.collection.children.link(inside)
    for name in ("Box", "Mirror"):
        obj = bpy.data.objects[name]
        scene.collection.objects.unlink(obj)
        inside.objects.link(obj)
    bpy.context.view_layer.layer_collection.children["Inside"].indirect_only = True


CASES: dict[str, Callable[[], None]] = {
    "plain": hide("Box"),
    "no camera rays": hide("Box", "camera"),
    "no diffuse rays": hide("Box", "diffuse"),
    "no glossy rays": hide("Box", "glossy"),
    "no shadow rays": hide("Box", "shadow"),
    "camera rays alone": hide("Box", "diffuse", "glossy", "shadow"),
    "wall without diffuse rays": hide("Back", "diffuse"),
    "wall without glossy rays": hide("Back", "glossy"),
    "no shadow": lambda: setattr(bpy.data.lights["Lamp"], "use_shadow", False),
    "one bounce": max_bounces,
    "holdout": lambda: setattr(bpy.data.objects["Box"], "is_holdout", True),
    "holdout shader": holdout_shader,
    "emissive without diffuse rays": emissive(visible_diffuse=False),
    "emissive without glossy rays": emissive(visible_glossy=False),
    "holdout that is emissive": emissive(is_holdout=True),
    "indirect only": indirect_only,
}


@pytest.mark.thorough(
    "no shadow rays",
    "emissive without glossy rays",
    "camera rays alone",
    "holdout that is emissive",
    "wall without",
    "indirect only",
)
@pytest.mark.parametrize("case", CASES)
def test_as_cycles(device: Device, scene: bpy.types.Scene, case: str) -> None:
    """Block means, with no factor between the two, and alpha."""
    CASES[case]()
    exported, _ = snapshot(bpy.context.evaluated_depsgraph_get())
    size = {"width": SIZE, "height": SIZE, "passes": 16, "photons": 30000}
    ours = blocks(render(device, exported, **size, radius_decay=2 / 3)["Combined"])
    theirs = blocks(by_cycles(scene))
    light = theirs[..., :3].mean()
    assert ours[..., :3].mean() == pytest.approx(light, rel=0.01)
    off = np.abs(ours - theirs)[..., :3] / (theirs[..., :3] + 0.5 * light)
    assert np.sqrt((off**2).mean()) < 0.03 and off.max() < 0.12
    assert np.abs(ours - theirs)[..., 3].max() < 0.05
    assert (theirs[..., 3].min() < 0.5) == case.startswith("holdout")


def blocks(image: NDArray[Any]) -> NDArray[Any]:
    count = SIZE // BLOCK
    return np.asarray(image, float).reshape(count, BLOCK, count, BLOCK, 4).mean((1, 3))


def by_cycles(scene: bpy.types.Scene) -> NDArray[np.float32]:
    """(h, w, 4), row 0 at the bottom."""
    prepare(scene, samples=256, seed=1)
    scene.render.image_settings.color_mode = "RGBA"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(scene.render.filepath) as file:
            return np.array(file.channels()["RGBA"].pixels[::-1])
