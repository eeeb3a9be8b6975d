# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras in awkward places, pictures of awkward sizes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.streams import Device
from tests.measure import not_finite, render_clean
from tests.scenes import (
    GREY,
    Builder,
    backdrop,
    camera,
    cornell,
    orthographic,
    plain_light,
    replace,
)
from tests.stability.table import Measured


@pytest.mark.stability(37)
def test_every_photon_escapes(device: Device, measured: Measured) -> None:
    """The only light shines away from the only surface."""
    away = plain_light("away", "SPOT", (0, 0, 1), (100.0,) * 3, (0.0, 0.0, 1.0))
    plate = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    scene = plate.scene(camera((0, -4, 1), (0, 0, 0)), [away], [GREY], background=(0.1, 0.2, 0.3))
    images = render_clean(device, scene, passes=2)
    assert not images["Direct"].any() and not images["Indirect"].any()
    sky = images["Depth"][..., 0] > 1e9  # in the first pass
    for axis in (0, 1):  # those whose neighbours are, too, show it in all
        sky &= np.roll(sky, 1, axis) & np.roll(sky, -1, axis)
    assert sky.any() and not sky.all()
    error = np.abs(images["Combined"][sky] / np.float32([0.1, 0.2, 0.3, 1.0]) - 1).max()
    assert measured("background off by", error) <= 1e-6


INSIDE = {
    "a closed box": (5.0, 5.0, 5.0),
    "a surface": (5.0, 3.0, 0.0),
    "an edge": (0.0, 3.0, 0.0),
    "a lamp": (5.0, 5.0, 9.9),
}


@pytest.mark.stability(39)
@pytest.mark.thorough("splat-a lamp", "splat-a surface", "splat-an edge")
@pytest.mark.parametrize("where", INSIDE)
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_camera_inside(device: Device, measured: Measured, where: str, estimator: str) -> None:
    """In a solid, a surface, an edge, a lamp's sphere; with a near plane and without."""
    scene = cornell(True)
    if where == "a closed box":
        box = Builder().box((4, 4, 4), (6, 6, 6))
        scene = box.scene(scene.camera, scene.lights, [GREY])
    if where == "a lamp":
        scene = replace(
            scene,
            lights=(
                replace(scene.lights[0], parameters={**scene.lights[0].parameters, "radius": 1.0}),
            ),
        )
    matrix = np.array(scene.camera.matrix)
    matrix[:3, 3] = INSIDE[where]
    for near in (0.0, 0.1):
        view = replace(scene.camera, matrix=matrix, clip_start=near, clip_end=1000.0)
        images = render_clean(device, replace(scene, camera=view), estimator=estimator, passes=2)
        depth = images["Depth"]
        assert depth.min() >= near
        assert measured("values that are not finite", not_finite(images)) == 0
    if where == "a closed box":
        assert images["Combined"][..., :3].max() == 0.0  # the lamp is outside


@pytest.mark.stability(40)
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_no_photon_reaches_the_view(device: Device, measured: Measured, estimator: str) -> None:
    """A dark room beside the lit one."""
    b = Builder().box((-3, -1, -1), (-1, 1, 1)).box((1, -1, -1), (3, 1, 1))
    light = plain_light("light", "POINT", (-2, 0, 0), (100.0,) * 3)
    scene = b.scene(orthographic((2, 0, 0), (1, 0, 0), (0, 0, 1), 1.8), [light], [GREY])
    images = render_clean(device, scene, estimator=estimator, radius=0.3, passes=2)
    assert (images["Depth"] < 1e9).all()
    assert measured("light in the dark room", images["Combined"][..., :3].max()) == 0


@pytest.mark.stability(55)
@pytest.mark.thorough("fragment-size0", "fragment-size2", "fragment-size4", "compute-size1")
@pytest.mark.parametrize("size", [(1, 1), (16384, 1), (1, 16384), (17, 13), (1025, 3)])
@pytest.mark.parametrize("backend", ["fragment", "compute"])
def test_sizes(device: Device, measured: Measured, backend: str, size: tuple[int, int]) -> None:
    """No pixel is left out, at sizes that no group of threads divides."""
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    scene = replace(cornell(), lights=(*cornell().lights, *backdrop((0.5,) * 3)))
    width, height = size
    images = render_clean(device, scene, width=width, height=height, backend=backend, photons=2000)
    assert images["Combined"].shape == (height, width, 4)
    assert measured("pixels left out", np.count_nonzero(images["Combined"][..., 3] != 1.0)) == 0
    lit = images["Combined"][..., :3].sum(axis=-1) > 0
    assert lit.mean() > 0.5


@pytest.mark.stability(55)
def test_border_of_a_large_frame(device: Device, measured: Measured) -> None:
    """Parts of a frame of 16384 x 16384 are each other's crops, to the bit."""
    settings: dict[str, Any] = {"width": 16384, "height": 16384, "photons": 2000, "passes": 2}
    whole = render_clean(device, cornell(True), region=(8000, 7000, 8032, 7024), **settings)
    part = render_clean(device, cornell(True), region=(8003, 7011, 8020, 7024), **settings)
    differ = sum(np.count_nonzero(part[x] != whole[x][11:24, 3:20]) for x in part)
    assert measured("crop's values that differ", differ) == 0


@pytest.mark.stability(39)
def test_orthographic_camera_inside(device: Device, measured: Measured) -> None:
    """Its rays start in the walls of a box that it halves."""
    b = Builder().box((-1, -1, -1), (1, 1, 1))
    light = plain_light("light", "POINT", (0, 0, 0.5), (100.0,) * 3)
    images = render_clean(device, b.scene(camera((0, 0, 0), (1, 0, 0)), [light], [GREY]))
    assert images["Combined"][..., 3].min() == 1.0
    view = orthographic((0, 0, 0), (1, 0, 0), (0, 0, 1), 2.0)
    images = render_clean(device, b.scene(view, [light], [GREY]))
    assert math.isclose(images["Depth"][16, 16, 0], 1.0, rel_tol=1e-5)
    measured("values that are not finite", 0)
