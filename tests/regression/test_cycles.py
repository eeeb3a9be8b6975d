# SPDX-License-Identifier: GPL-3.0-or-later
"""Six scenes against Cycles: block means, with no factor between the two.

The references in blend_scenes/references come from make_references.py, which renders for
half an hour; here Cycles renders a few samples to see that they are still its pictures.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel, snapshot
from addon.photon.scene import Scene
from addon.streams import Device
from tests.blender.build import nodes_of
from tests.measure import render
from tests.stability.table import Measured

from .blocks import Difference, compare, smooth_blocks
from .cycles import LIT, REFERENCES, SCENES, SIZE, SIZES, open_blend, read_exr, render_cycles

pytestmark = pytest.mark.blender

MEDIAN, HIGH = 0.01, 0.03  # relative, of blocks; HIGH at their 95th percentile
# Our own noise is then a sixth of a percent in the median; with few passes 0.3 %.
PASSES, FEW_PASSES, PHOTONS = 128, 48, 262144
MARGIN = 1  # [px] around edges
# Passes and photons of the scenes that LIT names. Few photons find the window of daylight, and few
# shadow rays what is bright beyond it. In the kitchen discs must be small: much stands close.
QUICK = {"studio": (12, 65536)}
MANY = {"studio": (128, 65536), "daylight": (512, 131072), "kitchen": (32, 262144)}

Record = Callable[[str, object], None]


def differences(
    device: Device, name: str, passes: int, photons: int
) -> tuple[Difference, Difference]:
    """Of smooth blocks, and of all."""
    exported = open_blend(name)
    images = render(
        device,
        exported,
        width=SIZES[name],
        height=SIZES[name],
        passes=passes,
        photons=photons,
        radius_decay=2 / 3,
    )
    keep = smooth_blocks(images, exported.camera, MARGIN)
    ours, reference = images["Combined"][..., :3], read_exr(REFERENCES / f"{name}.exr")
    return compare(ours, reference, keep), compare(ours, reference, np.ones_like(keep))


@pytest.mark.slow
@pytest.mark.thorough("cornell_box", "cornell_classic")
@pytest.mark.parametrize("name", [name for name in SCENES if name not in LIT])
def test_block_means_are_those_of_cycles(
    device: Device, name: str, thorough: bool, record_property: Record
) -> None:
    found, everywhere = differences(device, name, PASSES if thorough else FEW_PASSES, PHOTONS)
    figures = {
        "median": found.median,
        "95th percentile": found.high,
        "mean": found.bias,
        "share of blocks": found.share,
        "all blocks' median": everywhere.median,
        "all blocks' 95th percentile": everywhere.high,
    }
    for what, value in figures.items():
        record_property(what, value)
    print(f"\n{name}: " + ", ".join(f"{what} {value:.3%}" for what, value in figures.items()))
    assert found.share > 0.5
    assert found.median <= MEDIAN
    assert found.high <= HIGH
    assert everywhere.median <= MEDIAN
    assert everywhere.high <= HIGH


@pytest.mark.stability(76)
@pytest.mark.parametrize("name", LIT)
def test_area_lights_sun_and_sky_are_those_of_cycles(
    device: Device, name: str, thorough: bool, measured: Measured
) -> None:
    if not thorough and name not in QUICK:
        pytest.skip("runs with --stability")
    counts = MANY[name] if thorough else QUICK[name]
    found, everywhere = differences(device, name, *counts)
    for which, some in (("smooth", found), ("all", everywhere)):
        told = f"median {some.median:.2%}, 95th {some.high:.2%}, mean {some.bias:.2%}"
        print(f"\n{name}, {which} blocks ({some.share:.0%}): {told}")
    assert found.share > 0.25
    assert measured(f"{name}: smooth blocks in the median", found.median, "%") <= MEDIAN
    assert measured(f"{name}: at the 95th percentile", found.high, "%") <= HIGH
    assert measured(f"{name}: all blocks in the median", everywhere.median, "%") <= MEDIAN
    assert abs(everywhere.bias) <= MEDIAN / 2


@pytest.mark.thorough(
    "daylight", "kitchen", "cornell_box", "cornell_classic"
)  # as what is compared with them
@pytest.mark.parametrize("name", SCENES)
def test_references_are_what_cycles_renders(name: str, record_property: Record) -> None:
    """The mean of the whole picture lies within the noise of a quick render."""
    runs = []
    for seed in range(4):
        exported = open_blend(name, SIZE // 4)  # a box filter's mean is that of any resolution
        runs.append(render_cycles(exported, 128, seed).mean(axis=(0, 1), dtype=float))
    mean = np.mean(runs, axis=0)
    error = np.std(runs, axis=0, ddof=1) / math.sqrt(len(runs))
    reference = read_exr(REFERENCES / f"{name}.exr").mean(axis=(0, 1), dtype=float)
    record_property("difference", (mean / reference - 1).tolist())
    print(f"\n{name}: {mean / reference - 1}, standard error {error / mean}")
    assert (error < 0.004 * mean).all()
    # Student's t of 3 degrees of freedom: 99 % within 5.84 standard errors.
    assert (np.abs(mean - reference) < 5.84 * error + 0.002 * reference).all()


def test_daylight_is_exported_as_it_is() -> None:
    """As `open_blend` sees to; the other scenes have quick tests."""
    assert open_blend("daylight", 16).lights


def test_the_lobe_in_cycles_is_ours() -> None:
    """A lamp over a plane of nothing but a lobe: Cycles against Lafortune & Willems' formula."""
    size, n = 32, 20.0
    exported = lamp_over_glossy_plane(size, n)
    (lamp,), (material,) = exported.lights, exported.materials
    (lobe,) = material.lobes
    assert lobe.kind == "phong" and lobe.parameters["exponent"] == pytest.approx(n)
    rendered = render_cycles(exported, 512, 1)

    fine = 8 * size  # points a pixel's width / 8 apart
    left, right, bottom, top = exported.camera.window
    x = np.linspace(left, right, fine, endpoint=False) + (right - left) / (2 * fine)
    y = np.linspace(bottom, top, fine, endpoint=False) + (top - bottom) / (2 * fine)
    matrix = exported.camera.matrix
    rays = np.stack([*np.meshgrid(x, y), -np.ones((fine, fine))], -1) @ matrix[:3, :3].T
    points = matrix[:3, 3] - rays * (matrix[2, 3] / rays[..., 2:])
    to_lamp = np.array(lamp.position) - points
    distance = np.linalg.norm(to_lamp, axis=-1, keepdims=True)
    to_lamp /= distance
    viewer = -rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    mirrored = to_lamp * (-1, -1, 1)  # about the normal (0, 0, 1)
    alpha = (mirrored * viewer).sum(-1, keepdims=True).clip(0)
    irradiance = np.array(lamp.power) / (4 * np.pi * distance**2) * to_lamp[..., 2:]
    radiance = np.array(lobe.colour) * (n + 2) / (2 * np.pi) * alpha**n * irradiance
    expected = radiance.reshape(size, 8, size, 8, 3).mean(axis=(1, 3))
    bright = expected > 0.05 * expected.max()
    assert bright.any()
    np.testing.assert_allclose(rendered.sum((0, 1)), expected.sum((0, 1)), rtol=5e-4)
    np.testing.assert_allclose(rendered[bright], expected[bright], rtol=0.01)


def lamp_over_glossy_plane(size: int, exponent: float) -> Scene:
    """Make that scene in Blender and export it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size

    def add(data: bpy.types.ID, location: Any, tilt: float = 0.0) -> bpy.types.Object:
        obj = bpy.data.objects.new(data.name, data)
        obj.location, obj.rotation_euler = location, (tilt, 0, 0)
        scene.collection.objects.link(obj)
        return obj

    scene.camera = add(bpy.data.cameras.new("Camera"), (0, -4, 4), math.radians(45))
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = 100
    add(lamp, (0.5, 2, 3))
    plane = bpy.data.meshes.new("Plane")
    plane.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("Lobe")
    tree = nodes_of(material)
    tree.nodes.clear()
    glossy = tree.nodes.new("ShaderNodeBsdfAnisotropic")
    glossy.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1)
    glossy.inputs["Roughness"].default_value = (2 / (exponent + 2)) ** 0.25
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(glossy.outputs[0], output.inputs["Surface"])
    plane.materials.append(material)
    add(plane, (0, 0, 0))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    exported, _ = snapshot(depsgraph, model=SpecularModel.PHONG)
    return exported
