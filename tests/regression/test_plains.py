# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes on a plain of a kilometre against Cycles, on which a tenth of the light that bounces to
them comes from farther than ten metres."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector

from addon.blender.export import snapshot
from addon.streams import Device
from tests.blender.build import (
    CUBE,
    add_light,
    add_mesh,
    add_node,
    add_object,
    finish,
    new_world,
    shader_material,
)
from tests.measure import render

from .blocks import block_means
from .cycles import render_loaded

pytestmark = pytest.mark.blender

SIZE = 48  # [px]
PASSES, PHOTONS = 144, 30000
SAMPLES = 1024
MEAN, HIGH = 0.01, 0.05  # relative; HIGH is the 95th percentile of blocks
EYE, TARGET = Vector((2.2, -5.0, 0.8)), Vector((0.0, 0.2, 0.8))


def open_plain(half: float, at: Vector, kind: str) -> None:
    """Three boxes `at` a place of a plain that is two by `half` metres wide, under sun and sky; all
    of one shader."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    world = new_world(scene)
    finish(world, add_node(world, "ShaderNodeBackground", Color=(0.4, 0.6, 1.0, 1.0)))
    colour = {"ShaderNodeBsdfDiffuse": "Color"}.get(kind, "Base_Color")
    white, ground = (
        shader_material(kind, name, **{colour: shade})
        for name, shade in (("White", (0.8, 0.8, 0.8, 1.0)), ("Ground", (0.5, 0.4, 0.3, 1.0)))
    )
    add_mesh("Plain", scale=(half, half, 1.0)).data.materials.append(ground)
    for x, y, size in ((-0.75, 0.0, 0.5), (0.75, 0.0, 0.5), (0.0, 1.3, 0.7)):
        place = at + Vector((x, y, size))
        box = add_mesh("Box", CUBE, scale=(size,) * 3, location=place)
        box.data.materials.append(white)
    add_light("Sun", "SUN", energy=3.0, angle=0.01, rotation_euler=(-0.9, 0.0, 0.6))
    camera = add_object("Camera", bpy.data.cameras.new("Camera"), location=at + EYE)
    camera.rotation_euler = (TARGET - EYE).to_track_quat("-Z", "Y").to_euler()
    camera.data.lens, camera.data.clip_end = 60.0, 1e5
    scene.camera = camera
    bpy.context.view_layer.update()


@pytest.mark.parametrize(
    "half, at, kind",
    [
        (500.0, (0.0, 0.0, 0.0), "ShaderNodeBsdfDiffuse"),
        pytest.param(
            5000.0, (3000.0, -2000.0, 0.0), "ShaderNodeBsdfDiffuse", marks=pytest.mark.thorough
        ),
        pytest.param(
            500.0, (0.0, 0.0, 0.0), "ShaderNodeBsdfPrincipled", marks=pytest.mark.thorough
        ),
    ],
)
def test_boxes_show_what_they_show_in_cycles(
    device: Device, half: float, at: Any, kind: str
) -> None:
    open_plain(half, Vector(at), kind)
    exported, _ = snapshot(bpy.context.evaluated_depsgraph_get())
    settings = {"width": SIZE, "height": SIZE, "passes": PASSES, "photons": PHOTONS}
    images = render(device, exported, **settings, radius_decay=2 / 3)
    ours, reference = images["Combined"][..., :3], render_loaded(SAMPLES, 1)
    walls = np.abs(images["Normal"][..., 2]) < 0.01
    on_walls = block_means(np.where(walls & images["Normal"].any(axis=2), 1.0, 0.0)[..., None])
    keep = on_walls[..., 0] > 0.8
    assert keep.sum() >= 6
    found = block_means(ours)[keep] / block_means(reference)[keep] - 1.0
    print(f"\n{kind}: mean {found.mean():.3%}, high {np.percentile(np.abs(found), 95):.3%}")
    assert abs(found.mean()) < MEAN
    assert np.percentile(np.abs(found), 95) < HIGH
