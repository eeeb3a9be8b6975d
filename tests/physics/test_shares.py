# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons of a light go by what of it reaches the picture, and mean what they meant by flux."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.photons import shares
from addon.photon.prepare import prepare
from addon.photon.scene import Material, Scene, point_light
from addon.photon.settings import Settings
from addon.streams import Device
from tests.measure import rendered
from tests.scenes import Builder, camera, plain_material

WALL = plain_material("wall", (0.6, 0.5, 0.4))
SETTINGS: dict[str, Any] = {"width": 32, "height": 32, "photons": 20000, "passes": 8}
CANDLE = point_light("candle", (-0.3, 0.2, 0.5), (20.0,) * 3)
SUN = point_light("sun", (5.0, 5.0, 20.0), (1e6,) * 3)
LAMP = point_light("lamp", (0.5, -0.3, 0.4), (10.0,) * 3)


def room(*lights: Any, glow: Material = WALL) -> Scene:
    """A closed one, on a plain; something in it may glow."""
    built = Builder().box((-1, -1, -1), (1, 1, 1), 0, "room")
    low, high = -20, 20
    z = -1.01
    built.quad((low, low, z), (high, low, z), (high, high, z), (low, high, z), 0, "plain")
    built.box((0.1, -0.3, -1), (0.4, 0.3, 0.2), 1, "box")
    return built.scene(camera((-0.9, -0.9, 0.8), (0.3, 0.3, -0.4), 80), lights, [WALL, glow])


def chosen(device: Device, scene: Scene, **settings: Any) -> NDArray[Any]:
    """With which probability photons start at each light."""
    with rendered(device, scene, **(SETTINGS | {"passes": 2} | settings)) as renderer:
        found: NDArray[Any] = renderer.eye._tables.lights["chosen"].copy()
        return found


@pytest.mark.parametrize("layer", ["native", "fragment"])
def test_a_candle_beside_the_sun(device: Device, layer: str) -> None:
    """Gets its photons, and so its room the light that it has without a sun, which shines on its
    roof."""
    by_flux = CANDLE.power[0] / (CANDLE.power[0] + SUN.power[0])
    share = chosen(device, room(CANDLE, SUN), layer=layer)[0]
    assert share > 0.4 > 1e4 * by_flux
    alone, both = (
        np.mean(
            [
                images_of(device, scene, layer=layer, seed=seed)["Indirect"].mean(axis=(0, 1))
                for seed in range(3)
            ],
            axis=0,
        )
        for scene in (room(CANDLE), room(CANDLE, SUN))
    )
    np.testing.assert_allclose(both, alone, rtol=0.02)


def images_of(device: Device, scene: Scene, **settings: Any) -> dict[str, Any]:
    with rendered(device, scene, **(SETTINGS | settings)) as renderer:
        return renderer.images()


def test_lights_alike_get_photons_by_flux(device: Device) -> None:
    """Whatever the view, and so photons serve the next one."""
    assert chosen(device, room(CANDLE, LAMP)) == pytest.approx([2 / 3, 1 / 3], rel=1e-6)


def test_any_shares_mean_the_same(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is asked of lamps and of what glows, however many photons each gets."""
    glow = Material("glow", (0.2,) * 3, (), (0.5, 1.0, 2.0))
    scene, found = room(CANDLE, LAMP, glow=glow), []
    for gain in (0.0, np.inf):
        monkeypatch.setattr(shares, "LEAST_GAIN", gain)
        found.append((chosen(device, scene), images_of(device, scene)["Indirect"]))
    assert np.abs(found[0][0] - found[1][0]).max() > 0.01
    assert all(share.min() > 0 and share.sum() == pytest.approx(1) for share, _ in found)
    means = [image.mean(axis=(0, 1)) for _, image in found]
    np.testing.assert_allclose(*means, rtol=0.02)


def test_shares_are_the_scene_s(device: Device) -> None:
    """Not the passes', the resolution's or a border's: ranges of passes merge to the bit."""
    scene = room(CANDLE, SUN)
    first = chosen(device, scene)
    for settings in ({"first_pass": 5}, {"width": 16, "height": 24}, {"region": (8, 8, 24, 16)}):
        np.testing.assert_array_equal(chosen(device, scene, **settings), first)


def test_one_light_asks_nothing(device: Device) -> None:
    renderer = prepare(room(CANDLE), Settings(8, 8, photons=100, layer="fragment"), device)
    launched = renderer.launches()["generator"]
    renderer.release()
    assert launched == 1


def test_a_first_picture_waits_for_nothing(device: Device) -> None:
    """Where lights are alike its photons go by flux; the next pass's by what is learned."""
    scene = room(CANDLE, LAMP)
    settings = Settings(8, 8, photons=100, layer="fragment")
    renderer = prepare(scene, settings, device)
    renderer.render_pass()
    assert renderer.launches()["generator"] == 1
    renderer.render_pass()
    assert renderer.launches()["generator"] == 4
    renderer.release()
