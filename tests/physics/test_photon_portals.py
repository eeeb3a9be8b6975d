# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons go on through portals, such as a door's gap: they mean what they meant, and more of them
arrive."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.records import PORTAL
from addon.photon.photons import aim
from addon.photon.photons.photon_portals import NO_PORTALS
from addon.photon.scene import Lobe, Material, Scene, point_light
from addon.streams import Device
from tests.measure import fallen, rendered
from tests.scenes import DIM, Builder, camera, closed_sphere, plain_material

SETTINGS: dict[str, Any] = {"width": 24, "height": 24, "photons": 20000, "radius": 0.4}
WALL = plain_material("wall", (0.7, 0.5, 0.3))
SHEEN = plain_material("sheen", (0.4, 0.5, 0.3), (0.2, 0.3, 0.2), 20.0)
GAP = (0.8, 1.3)  # along x
LOW, HIGH = 0.9, 0.6  # where it begins, and its height


def rooms(*lights: Any) -> Scene:
    """Two of 4 m by 3 m, a gap between them, and the floor of the one where the eye is."""
    built = Builder().box((-2, -3, 0), (2, 3, 2.5), 0, "walls", skip="-z")
    built.quad((-2, -3, 0), (2, -3, 0), (2, 0, 0), (-2, 0, 0), 1, "floor")
    built.quad((-2, 0, 0), (2, 0, 0), (2, 3, 0), (-2, 3, 0), 1, "lit floor")
    built.box((-2, 0, 0), (GAP[0], 0.1, 2.5), 0, "left")
    built.box((GAP[1], 0, 0), (2, 0.1, 2.5), 0, "right")
    built.box((GAP[0], 0, 0), (GAP[1], 0.1, LOW), 0, "sill")
    built.box((GAP[0], 0, LOW + HIGH), (GAP[1], 0.1, 2.5), 0, "lintel")
    return built.scene(camera((-1.5, -0.3, 2.2), (0.3, -2.2, 0.2), 75), lights, [WALL, SHEEN])


# None of its light comes through the gap without a bounce.
LAMP = point_light("lamp", (-1.7, 0.4, 1.5), (100.0, 80.0, 60.0))
NEAR = point_light("near", (-1.0, -2.0, 1.5), (5.0,) * 3)
SCENE = rooms(LAMP)


def of_gap() -> NDArray[Any]:
    """The gap as a portal, in scene units, of which one is 3 m, about the scene's middle."""
    portal = PORTAL.zeros(1)
    portal["across"], portal["axis"] = (1, 0, 0), (0, 1, 0)
    portal["middle"] = (1.05 / 3.0, 0.05 / 3.0, (LOW + HIGH / 2.0 - 1.25) / 3.0)
    portal["width"], portal["height"] = 0.5 / 3.0, HIGH / 3.0
    return portal


def force(monkeypatch: pytest.MonkeyPatch, portals: NDArray[Any]) -> None:
    monkeypatch.setattr(aim, "sees_no_lamp", lambda *_: True)
    monkeypatch.setattr(aim, "portals_by", lambda *_: portals)


def arrived(device: Device, scene: Scene, **settings: Any) -> tuple[NDArray[Any], Any]:
    """The flux that falls on a scene's surfaces in a pass, and through which portals."""
    with rendered(device, scene, **(SETTINGS | settings)) as renderer:
        return fallen(renderer), renderer.eye._tables.photon_portals.copy()


def test_a_gap_is_found_and_gains(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """On the floor in front of it the same flux to its noise, and a fifth of the variance."""
    seeds, small = range(10), {"width": 4, "height": 4, "photons": 5000}
    _, portals = arrived(device, SCENE)
    assert len(portals)
    found = []
    for some in (NO_PORTALS, portals):
        force(monkeypatch, some)
        each = [arrived(device, SCENE, seed=seed, **small)[0][1] for seed in seeds]
        found.append(np.array(each))
    before, after = found
    chance = np.sqrt((before.var(axis=0) + after.var(axis=0)) / (len(seeds) - 1))
    assert (np.abs(before.mean(axis=0) - after.mean(axis=0)) < 3.0 * chance).all()
    assert after.var(axis=0).mean() < before.var(axis=0).mean() / 5.0


def test_no_layer_differs(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Natively, by fragment and by compute programs photons land in the same places."""
    force(monkeypatch, of_gap())
    settings = {"photons": 4000, "width": 8, "height": 8}
    found = [
        arrived(device, SCENE, backend=backend, **settings)[0]
        for backend in ("native", "fragment", "compute")
    ]
    np.testing.assert_allclose(found[1], found[2], rtol=0.0 if device.is_software else 1e-6)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-4)


def test_no_photon_gains(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a surface absorbs a fifth of a channel or more no flux is above what it is without."""
    most = []
    for portals in (NO_PORTALS, of_gap()):
        force(monkeypatch, portals)
        with rendered(device, SCENE, **SETTINGS) as renderer:
            assert renderer.photons
            _, deposit = renderer.photons.mapper.deposits.arrays()
            most.append(deposit[:, :3].max())
    assert most[1] <= 1.001 * most[0]


@pytest.mark.parametrize("backend", ["native", "fragment"])
def test_a_furnace_stays_even(
    device: Device, monkeypatch: pytest.MonkeyPatch, backend: str
) -> None:
    """White walls, and a portal in their midst, where nothing is to be gained."""
    portal = PORTAL.zeros(1)
    portal["across"], portal["axis"] = (1, 0, 0), (0, 0.6, 0.8)
    portal["middle"], portal["width"], portal["height"] = (0.2, -0.1, 0.1), 1.1, 0.7
    force(monkeypatch, portal)
    bounces, settings = 4, {"photons": 60000, "photon_bounces": 4, "width": 8, "height": 8}
    flux, _ = arrived(device, closed_sphere(1.0), backend=backend, **settings)
    monkeypatch.undo()
    plain, _ = arrived(device, closed_sphere(1.0), backend=backend, **settings)
    np.testing.assert_allclose(plain, 4.0 * np.pi * bounces, rtol=1e-3)
    np.testing.assert_allclose(flux, plain, rtol=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("backend", ["fragment", "compute"])
def test_below_what_lies_over(
    device: Device, monkeypatch: pytest.MonkeyPatch, backend: str
) -> None:
    """A floor under a dielectric, which reflects more towards the horizon: what comes from it to a
    wall through a portal is as much as without."""
    if backend == "compute" and not device.has_compute:
        pytest.skip("no compute programs")
    shape = {"alpha_x": 0.09, "alpha_y": 0.09, "turn": 0.0, "compensated": 1.0, "ior": 1.5}
    glaze = Lobe("ggx_dielectric", (0.04,) * 3, shape, covered=(0.6, 0.5, 0.4))
    built = Builder().quad((-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0), 0, "floor")
    built.box((2, -1, 0.02), (2.1, 1, 0.8), 1, "wall")
    materials = [Material("glazed", (0.0,) * 3, (glaze,)), DIM]
    lamp = point_light("lamp", (0, 0, 0.7), (100.0,) * 3)
    scene = built.scene(camera((2.5, 0, 0.3), (2.05, 0, 0.3), 40), [lamp], materials)
    portal = PORTAL.zeros(1)
    portal["across"], portal["axis"] = (0, 1, 0), (-1, 0, 0)
    portal["middle"], portal["width"], portal["height"] = (1.99 / 5, 0, 0), 2 / 5, 0.8 / 5
    settings = {"backend": backend, "photons": 200_000, "width": 4, "height": 4}
    found = []
    for portals in (NO_PORTALS, portal):
        force(monkeypatch, portals)
        each = [arrived(device, scene, seed=seed, **settings)[0][1].mean() for seed in range(6)]
        found.append(np.array(each))
    chance = np.sqrt((found[0].var() + found[1].var()) / 5)
    assert abs(found[0].mean() - found[1].mean()) < 3.0 * chance < 0.06 * found[0].mean()


def test_where_the_lamp_is_seen_there_are_none(device: Device) -> None:
    """And no other program is made."""
    settings = {"photons": 2000, "backend": "fragment"}
    with rendered(device, rooms(LAMP, NEAR), **(SETTINGS | settings)) as renderer:
        assert not len(renderer.eye._tables.photon_portals)
        assert renderer.photons
        assert len(renderer.photons.mapper._bounce._reflectors.made()) == 1  # type: ignore[attr-defined]


def test_passes_are_the_scene_s_and_the_seed_s(device: Device) -> None:
    """Pass 1 alone is pass 1 after pass 0, to the bit."""
    both = [
        arrived(device, SCENE, first_pass=first, passes=2 - first, photons=4000) for first in (0, 1)
    ]
    np.testing.assert_array_equal(both[0][0], both[1][0])
    assert both[0][1].tobytes() == both[1][1].tobytes() and len(both[0][1])
