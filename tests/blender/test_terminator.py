# SPDX-License-Identifier: GPL-3.0-or-later
"""Coarse meshes with smooth normals: what an object's Geometry Offset lights, against Cycles."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from addon.streams import Device
from tests.measure import render

from .build import add_light, add_mesh, shader_material
from .lobes import DIFFUSE

pytestmark = pytest.mark.blender
SIZE = 64  # [px]


def tube(sides: int) -> tuple[list[tuple[float, float, float]], list[tuple[int, ...]]]:
    """An open one, whose inside is seen."""
    turns = [2.0 * math.pi * side / sides for side in range(sides)]
    ends = [(math.cos(x), math.sin(x), z) for z in (-1.0, 1.0) for x in turns]
    faces = [(x, (x + 1) % sides, sides + (x + 1) % sides, sides + x) for x in range(sides)]
    return ends, faces


@pytest.mark.thorough("12-0.5-0.5")
@pytest.mark.parametrize(("sides", "offset", "most"), [(8, 0.5, 0.25), (12, 0.5, 0.5)])
def test_inside_a_coarse_tube(
    scene: bpy.types.Scene,
    export: Callable[..., Any],
    cycles_mean: Callable[..., Any],
    device: Device,
    sides: int,
    offset: float,
    most: float,
) -> None:
    """Triangles that the smooth surface would be below are lit as if light came from above their
    corners' planes, too: the same ones, by as much."""
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.camera.location, scene.camera.rotation_euler = (0, -3, 3.5), (0.709, 0, 0)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.cycles.max_bounces = 0
    wall = add_mesh("Tube", tube(sides))
    wall.data.materials.append(shader_material(DIFFUSE, Color=(0.8, 0.8, 0.8, 1)))
    wall.data.polygons.foreach_set("use_smooth", [True] * len(wall.data.polygons))
    add_light("Sun", "SUN", energy=3.0, angle=0.02, rotation_euler=(1.0, 0.3, 0.8))
    settings = {"width": SIZE, "height": SIZE, "passes": 32, "photons": 0}
    changes = []
    for way in ("theirs", "ours"):
        found = []
        for own in (0.0, offset):
            wall.shadow_terminator_geometry_offset = own
            if way == "theirs":
                found.append(cycles_mean(256, 1)[..., :3])
            else:
                found.append(render(device, export()[0], **settings)["Combined"][..., :3])
        changes.append(found[1] - found[0])
    theirs, ours = changes
    assert np.abs(theirs).mean() > 1e-4  # else the scene shows nothing
    assert np.abs(theirs - ours).mean() < most * np.abs(theirs).mean()
