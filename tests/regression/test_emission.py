# SPDX-License-Identifier: GPL-3.0-or-later
"""A room that meshes light, against Cycles: block means, with no factor between the two."""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy
import numpy as np
import pytest

from addon.blender.export import snapshot
from addon.streams import Device
from tests.blender.build import CUBE, add_mesh, add_node, add_object, finish, new_material
from tests.measure import render

from .blocks import compare, smooth_blocks
from .cycles import render_loaded

pytestmark = pytest.mark.blender

SIZE = 64
MEDIAN, HIGH = 0.01, 0.03  # relative, of blocks; HIGH at their 95th percentile

Record = Callable[[str, object], None]


def open_room() -> None:
    """A cube from inside: a panel below the ceiling, an emissive ball of Principled, a glossy
    wall, and a box that throws shadows."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.camera = add_object("Camera", bpy.data.cameras.new("Camera"), location=(0, -0.95, 0))
    scene.camera.rotation_euler = (math.radians(90), 0, 0)
    scene.camera.data.lens = 18.0

    def wearing(name: str, kind: str, **inputs: object) -> bpy.types.Material:
        material, tree = new_material(name)
        finish(tree, add_node(tree, kind, **inputs))
        return material

    principled = "ShaderNodeBsdfPrincipled"
    grey = wearing("grey", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.5, 0.4, 1.0))
    gloss = wearing("gloss", principled, Base_Color=(0.4, 0.5, 0.6, 1.0), Roughness=0.4)
    panel = wearing("panel", "ShaderNodeEmission", Color=(1.0, 0.9, 0.8, 1.0), Strength=6.0)
    given = {"Base_Color": (0.3, 0.3, 0.3, 1.0), "Emission_Color": (0.3, 0.6, 1.0, 1.0)}
    ball = wearing("ball", principled, **given, Emission_Strength=4.0)
    room = add_mesh("Room", CUBE)
    room.data.materials.append(grey)
    room.data.materials.append(gloss)
    room.data.polygons[1].material_index = 1  # at +x
    add_mesh("Panel", scale=(0.4, 0.3, 1), location=(0.1, 0.2, 0.9)).data.materials.append(panel)
    box = add_mesh("Box", CUBE, scale=(0.2, 0.2, 0.35), location=(0.3, 0.4, -0.65))
    box.rotation_euler = (0, 0, 0.4)
    box.data.materials.append(grey)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.2, location=(-0.5, 0.3, -0.6))
    bpy.context.object.data.materials.append(ball)


@pytest.mark.thorough
def test_block_means_are_those_of_cycles(device: Device, record_property: Record) -> None:
    open_room()
    exported, _ = snapshot(bpy.context.evaluated_depsgraph_get())
    images = render(
        device,
        exported,
        width=SIZE,
        height=SIZE,
        passes=128,
        photons=100_000,
        radius_decay=2 / 3,
    )
    reference = render_loaded(2048, 1)
    ours = images["Combined"][..., :3]
    keep = smooth_blocks(images, exported.camera, 0)
    found, everywhere = compare(ours, reference, keep), compare(ours, reference, np.ones_like(keep))
    for what, value in (("median", found.median), ("95th percentile", found.high)):
        record_property(what, value)
    assert found.share > 0.2
    assert found.median <= MEDIAN and everywhere.median <= MEDIAN
    assert found.high <= HIGH and everywhere.high <= HIGH
