# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that bumps have scattered many times: photons meet them as fine as Cycles' paths do."""

from __future__ import annotations

import math

import bpy
import pytest

from addon.blender.export import snapshot
from addon.streams import Device
from tests.measure import render

from .cycles import TURNED_OFF, render_loaded
from .glossy_room import add, new_material

pytestmark = pytest.mark.blender

SIZE = 48


def bumpy_room() -> None:
    """A bright cube from within, its walls finer than a pixel of this size in places."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    material = new_material("Bumpy", "ShaderNodeBsdfDiffuse", (0.8, 0.8, 0.8))
    tree = material.node_tree
    kinds = "ShaderNodeBump", "ShaderNodeTexNoise", "ShaderNodeTexCoord"
    bump, noise, place = map(tree.nodes.new, kinds)
    bump.inputs["Strength"].default_value, bump.inputs["Distance"].default_value = 1.0, 0.0105
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 38.0, 3.0
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], bump.inputs["Height"])
    tree.links.new(bump.outputs[0], tree.nodes["Shader"].inputs["Normal"])
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    room = bpy.data.meshes.new("Room")
    room.from_pydata(corners, [], sides)
    room.materials.append(material)
    add(room)
    light = bpy.data.lights.new("Lamp", "AREA")
    light.energy, light.size = 10, 0.5
    add(light, (0, 0, 0.95))
    scene, lens = bpy.context.scene, bpy.data.cameras.new("Camera")
    lens.lens = 18
    scene.camera = add(lens, (0, -0.95, 0))
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100


def test_photons_meet_bumps_as_paths_do(device: Device) -> None:
    """As fine as a thousandth of the room they would take 6 % of the light."""
    bumpy_room()
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get())
    lost = [e for e in report.entries if e.status != "exact" and e.feature not in TURNED_OFF]
    assert not lost
    images = render(device, exported, width=SIZE, height=SIZE, passes=8, photons=40000, radius=0.1)
    ours = images["Combined"][..., :3].mean(dtype=float)
    assert ours == pytest.approx(render_loaded(64, 1).mean(dtype=float), rel=0.02)
