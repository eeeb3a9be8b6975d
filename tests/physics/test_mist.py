# SPDX-License-Identifier: GPL-3.0-or-later
"""Mist, as Cycles' pass tells it: by how far things are, and through what is transparent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.photon.scene import RAY_BITS, Camera, Lobe, Material, Medium, Scene, sun_light
from addon.photon.scene.visibility import CATCHER, HOLDOUT
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, camera, orthographic, plain_material

BACKENDS = ["native", "compute", "fragment"]
GREY = plain_material("grey", (0.5, 0.5, 0.5))
SHEET = Material("sheet", (0.3,) * 3, (Lobe("transparent", (0.2, 0.4, 0.6)),))
BEGIN, DEPTH = 1.0, 8.0
SUN = sun_light("sun", (2.0, 2.0, 2.0), (0.0, 0.0, -1.0))


def half_covered(view: Camera) -> Scene:
    """A floor where x < 0, and where y < 0 a sheet above it that lets 0.4 of the light through."""
    built = Builder().quad((-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0), 0, "floor")
    built.quad((-9, -9, 1), (9, -9, 1), (9, 0, 1), (-9, 0, 1), 1, "sheet")
    return built.scene(view, (SUN,), (GREY, SHEET))


def left(away: float, power: float) -> float:
    """What mist leaves to see from so far away."""
    return 1.0 - float(np.clip((away - BEGIN) / DEPTH, 0.0, 1.0)) ** power


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_along_the_view(device: Device, backend: str, power: float) -> None:
    """Of an orthographic camera; what is seen through a sheet is as far as it is."""
    scene = half_covered(orthographic((0, 0, 5), (1, 0, 0), (0, 1, 0), 4.0))
    settings = {"width": 8, "height": 8, "passes": 2, "photons": 0, "backend": backend}
    found = render(device, scene, mist=(BEGIN, DEPTH, power), **settings)["Mist"]
    assert found.shape == (8, 8, 1)
    floor, sheet = left(5.0, power), left(4.0, power)
    expected = np.empty((8, 8))
    expected[4:, :4], expected[4:, 4:] = floor, 0.0
    expected[:4, :4], expected[:4, 4:] = 0.6 * sheet + 0.4 * floor, 0.6 * sheet
    np.testing.assert_allclose(found[..., 0], 1.0 - expected, atol=2e-6)


@pytest.mark.parametrize("backend", BACKENDS)
def test_about_the_eye(device: Device, backend: str) -> None:
    """Of a perspective camera: as far as a place is, not as deep."""
    scene = half_covered(camera((-4, 4, 3), (-4, 4, 0), 90))
    settings = {"width": 9, "height": 9, "passes": 1, "photons": 0, "backend": backend}
    images = render(device, scene, mist=(BEGIN, DEPTH, 1.0), **settings)
    depth, mist = images["Depth"][..., 0], images["Mist"][..., 0]
    away = BEGIN + DEPTH * mist
    assert depth == pytest.approx(3.0, rel=1e-5)
    assert away[4, 4] == pytest.approx(3.0, rel=0.02) and away[0, 0] > 3.0 * 1.5


def test_without_depth_there_is_none(device: Device) -> None:
    scene = half_covered(orthographic((0, 0, 5), (1, 0, 0), (0, 1, 0), 4.0))
    images = render(device, scene, mist=(0.0, 0.0, 1.0), passes=1, photons=0)
    mist = images["Mist"][..., 0]
    assert set(np.unique(mist.round(6))) == {0.0, np.float32(0.4), 1.0}
    assert "Mist" not in render(device, scene, passes=1, photons=0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_media_take_of_what_is_seen(device: Device, backend: str) -> None:
    """A clear box of what absorbs light shows as much of a floor as comes through; of a box alone
    nothing is seen."""
    box = Material("box", (0.0,) * 3, (Lobe("transparent", (1.0,) * 3),), medium=Medium((0.5,) * 3))
    built = Builder().quad((-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0), 0, "floor")
    built.box((-8, -8, 1), (8, 8, 2), 1, "box")
    view = orthographic((0, 0, 5), (1, 0, 0), (0, 1, 0), 4.0)
    scene = built.scene(view, (SUN,), (GREY, box))
    settings = {"width": 4, "height": 4, "passes": 1, "photons": 0, "backend": backend}
    found = render(device, scene, mist=(BEGIN, DEPTH, 1.0), **settings)["Mist"][..., 0]
    np.testing.assert_allclose(found[:, :2], 1.0 - np.exp(-0.5) * left(5.0, 1.0), atol=1e-5)
    np.testing.assert_allclose(found[:, 2:], 1.0, atol=1e-5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_held_out_is_not_there(device: Device, backend: str) -> None:
    """And shadow catchers are, as any other things."""
    scene = half_covered(orthographic((0, 0, 5), (1, 0, 0), (0, 1, 0), 4.0))
    opaque = replace(scene, materials=(GREY, GREY))
    settings = {"width": 4, "height": 4, "passes": 1, "photons": 0, "backend": backend}
    settings["mist"] = (BEGIN, DEPTH, 1.0)
    floor, sheet = 1.0 - left(5.0, 1.0), 1.0 - left(4.0, 1.0)
    rays = sum(RAY_BITS.values())
    for bits, shown in ((HOLDOUT, 1.0), (CATCHER, sheet)):
        flags = np.array([rays, rays | bits], np.uint8)
        found = render(device, replace(opaque, visible=flags), **settings)["Mist"][..., 0]
        np.testing.assert_allclose(found[:2], shown, atol=2e-6)
        np.testing.assert_allclose(found[2:, :2], floor, atol=2e-6)
        np.testing.assert_allclose(found[2:, 2:], 1.0, atol=2e-6)
