# SPDX-License-Identifier: GPL-3.0-or-later
"""Portals: shadow rays find the world through windows, and lose nothing beside them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.photons import aim
from addon.photon.photons.portals import NO_PORTALS, _stopped_by
from addon.photon.scene import Image, Lobe, Material, Scene, environment_light, world_light
from addon.photon.stage import tables
from addon.photon.stage.geometry import Mesh, frame_of
from addon.streams import Device
from tests.measure import rendered
from tests.scenes import Builder, camera, orthographic, plain_material

from .test_glass import glass

SKY = world_light("sky", (1.0, 1.5, 2.0))
SETTINGS: dict[str, Any] = {"width": 24, "height": 24, "photons": 20000}
ROUGH = {"alpha_x": 0.06, "alpha_y": 0.06, "turn": 0.0, "compensated": 1.0}
VIEW = orthographic((0, 2.0, 1.9), (1, 0, 0), (0, 1, 0), 3.6)
WALL = plain_material("wall", (0.5, 0.5, 0.5))


def add_room(built: Builder, side: bool) -> None:
    """4 m deep, with a window in one wall, or in another, too."""
    built.box((-2, -0.2, -0.2), (2, 4.2, 0), 0).box((-2, -0.2, 2), (2, 4.2, 2.2), 0)
    built.box((-2.2, -0.2, 0), (-2, 4.2, 2), 0).box((-2, 4, 0), (2, 4.2, 2), 0)
    for x in (-2.0, 0.5):
        built.box((x, -0.2, 0), (x + 1.5, 0, 2), 0)
    built.box((-0.5, -0.2, 0), (0.5, 0, 0.8), 0).box((-0.5, -0.2, 1.5), (0.5, 0, 2), 0)
    if side:
        built.box((2, -0.2, 0), (2.2, 2.5, 2), 0).box((2, 3.3, 0), (2.2, 4.2, 2), 0)
        built.box((2, 2.5, 0), (2.2, 3.3, 0.8), 0).box((2, 2.5, 1.5), (2.2, 3.3, 2), 0)
    else:
        built.box((2, -0.2, 0), (2.2, 4.2, 2), 0)


def room(side: bool = False, ball: float | None = None) -> Scene:
    """Its floor from above; `ball`: with one in it, that far to one side."""
    built = Builder()
    add_room(built, side)
    if ball is not None:
        built.sphere((ball, 2.0, 0.6), 0.5)
    return built.scene(VIEW, [SKY], [WALL])


def found(renderer: Any) -> NDArray[Any]:
    portals = renderer.eye._tables.portals
    return portals[portals["width"] > 0]


def direct(device: Device, scene: Scene, passes: int, **settings: Any) -> Any:
    with rendered(device, scene, **(SETTINGS | settings | {"passes": passes})) as renderer:
        return found(renderer), renderer.images()["Direct"].astype(float), renderer.frame


def without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aim, "portals_of", lambda *_: NO_PORTALS)


def test_a_window_is_found(device: Device) -> None:
    """Where it is, and as large; of a thick wall's, its narrowest part."""
    portals, _, frame = direct(device, room(), 1)
    assert len(portals) == 1
    (portal,) = portals
    middle = portal["middle"] * frame.scale + frame.centre
    np.testing.assert_allclose(middle, (0, -0.1, 1.15), atol=0.12)
    assert abs(portal["axis"][1]) > 0.99
    area = portal["width"] * portal["height"] * frame.scale**2
    assert 0.6 < area < 0.8  # of 0.7


def test_rays_end_at_what_is_nearest() -> None:
    """Windows are fitted along that, so it must not depend on the tree; or behind what is clear."""
    rays = np.zeros((50, 6))
    rays[:, :2] = np.random.default_rng(3).uniform(-0.9, 0.9, (50, 2))
    rays[:, 5] = 0.01
    for heights in (range(1, 7), range(6, 0, -1)):
        built = Builder()
        for z in heights:
            built.quad((-1, -1, z), (1, -1, z), (1, 1, z), (-1, 1, z), 0)
        scene = built.scene(VIEW, [SKY], [WALL])
        frame = frame_of(scene)
        mesh = Mesh.build(scene, frame)
        inside = rays.copy()
        inside[:, :3] = (rays[:, :3] - frame.centre) / frame.scale
        inside[:, 3:] = (0.0, 0.0, 1.0)
        z = mesh.corners[:, 0, 2] * frame.scale + frame.centre[2]
        for clear in (0.0, 2.5):
            ends = _stopped_by(inside, mesh, z < clear)
            np.testing.assert_allclose(z[ends], 1.0 if clear == 0.0 else 3.0, atol=1e-4)


def test_two_windows_are_found(device: Device) -> None:
    portals, _, frame = direct(device, room(side=True), 1)
    middles = portals["middle"] * frame.scale + frame.centre
    expected = [(0, -0.1, 1.15), (2.1, 2.9, 1.15)]
    np.testing.assert_allclose(middles[middles[:, 0].argsort()], expected, atol=0.25)


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("backend, side", [("native", False), ("native", True), ("compute", True)])
def test_light_is_the_same_and_quieter(
    device: Device, monkeypatch: pytest.MonkeyPatch, side: bool, backend: str
) -> None:
    """Of all the floor the mean to its noise, and a fiftieth of the variance: nothing comes past
    the portals."""
    scene, passes = room(side), 16
    portals, through, _ = direct(device, scene, passes, backend=backend)
    assert len(portals) == 1 + side
    _, again, _ = direct(device, scene, passes, backend=backend, seed=5)
    without(monkeypatch)
    none, plain, _ = direct(device, scene, passes, backend=backend)
    assert not len(none)
    _, other, _ = direct(device, scene, passes, backend=backend, seed=5)
    variance, before = ((a - b).var() / 2 for a, b in ((through, again), (plain, other)))
    assert variance < before / 50
    chance = np.sqrt((variance + before) / 2 / plain.size)
    assert abs((through + again).mean() - (plain + other).mean()) / 2 < 4 * chance


def test_a_glazed_window_is_found(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Shadow rays pass its pane: the mean to its noise, and a thirtieth of the variance."""
    built = Builder()
    add_room(built, side=False)
    built.box((-0.5, -0.11, 0.8), (0.5, -0.09, 1.5), 1)
    scene = built.scene(VIEW, [SKY], [WALL, glass(1.5)])
    portals, through, _ = direct(device, scene, 16)
    assert len(portals) == 1
    _, again, _ = direct(device, scene, 16, seed=5)
    without(monkeypatch)
    none, plain, _ = direct(device, scene, 16)
    assert not len(none)
    _, other, _ = direct(device, scene, 16, seed=5)
    variance, before = ((a - b).var() / 2 for a, b in ((through, again), (plain, other)))
    assert variance < before / 30
    chance = np.sqrt((variance + before) / 2 / plain.size)
    assert abs((through + again).mean() - (plain + other).mean()) / 2 < 4 * chance


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("backend", ["native", "compute"])
def test_lobes_and_shadow_rays_share_a_window(
    device: Device, monkeypatch: pytest.MonkeyPatch, backend: str
) -> None:
    """Several rays of a point go there, and those of its lobes count for one."""
    metal = Lobe("ggx_metal", (0.5, 0.4, 0.2), ROUGH | {"tint": (0.8, 0.9, 1.0)})
    worn = Material("worn", (0.2, 0.3, 0.1), (metal,))
    view = camera((0, 3.8, 1.5), (0, 1.5, 0), 60)  # the floor, in which it is reflected
    scene = replace(room(), camera=view, materials=(worn,))
    assert tables.WORLD_RAYS > 1

    def means(portals: int) -> Any:
        pictures = []
        for seed in (0, 5):
            settings = SETTINGS | {"passes": 32, "backend": backend, "seed": seed}
            with rendered(device, scene, **settings) as renderer:
                assert len(found(renderer)) == portals
                pictures.append(renderer.images()["Combined"][..., :3].astype(float))
        one, other = pictures
        return (one + other).mean() / 2, (one - other).std() / 2 / np.sqrt(one.size)

    through, noise = means(1)
    without(monkeypatch)
    plain, more_noise = means(0)
    assert abs(through - plain) < 4 * np.hypot(noise, more_noise)


def test_an_image_through_a_window(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a world that is not even the light is the same, too."""
    rng = np.random.default_rng(2)
    pixels = rng.random((8, 16, 3)).astype(np.float32) ** 4
    scene = room()
    light, image = environment_light("sky", 0), Image("sky", pixels)
    scene = replace(scene, lights=(light,), images=(image,))
    portals, through, _ = direct(device, scene, 48)
    assert len(portals) == 1
    without(monkeypatch)
    _, plain, _ = direct(device, scene, 48)
    chance = plain.std() / np.sqrt(plain.size)
    assert abs(through.mean() - plain.mean()) < 4 * chance


def test_out_of_doors_there_are_none(device: Device) -> None:
    built = Builder().box((-6, -6, -0.2), (6, 6, 0), 0).sphere((0, 0, 1), 0.8)
    view = orthographic((0, 0, 5), (1, 0, 0), (0, 1, 0), 6.0)
    portals, _, _ = direct(device, built.scene(view, [SKY], [WALL]), 1)
    assert not len(portals)
