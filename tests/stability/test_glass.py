# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass where others fail: stacks of media, indices near 1, lights that no shadow ray reaches."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Scene, point_light, sun_light
from addon.streams import Device
from tests.measure import fallen, render_clean, rendered
from tests.physics.test_glass import BLACK_WALL, EMISSIVE, WHITE, beam, glass, mean_of
from tests.scenes import UNIT_INTENSITY, Builder, camera, plain_material
from tests.stability.table import Measured

GLASS, WATER = 1.5, 1.333
SUN = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
DOWN = camera((0, 0, 5), (0, 0, 0))


def reflected(a: float, b: float) -> float:
    """Of light that meets the surface between two indices head-on."""
    return ((a - b) / (a + b)) ** 2


def fresnel(cosine: Any, ior: float) -> Any:
    """Of light that meets a surface at these cosines: the index is that of what lies behind."""
    bent = np.sqrt(np.maximum(0.0, 1.0 - (1.0 - cosine**2) / ior**2))
    s = (cosine - ior * bent) / (cosine + ior * bent)
    p = (ior * cosine - bent) / (ior * cosine + bent)
    return np.where(bent > 0.0, 0.5 * (s * s + p * p), 1.0)


def through(shares: list[float]) -> float:
    """What passes parallel surfaces of these reflectances, with all reflections between them."""
    passed, back = 1.0, 0.0  # of those so far, and what they reflect from behind
    for share in shares:
        passed *= (1.0 - share) / (1.0 - back * share)
        back = share + (1.0 - share) ** 2 * back / (1.0 - back * share)
    return passed


def sheets(built: Builder, *surfaces: tuple[float, int], size: float = 4.0) -> Builder:
    """Squares that look up, each at a height and of a material, in one mesh."""
    corners, triangles = [], []
    for number, (z, _) in enumerate(surfaces):
        corners += [(x * size, y * size, z) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        triangles += [[4 * number + k for k in of] for of in ((0, 1, 2), (0, 2, 3))]
    built.add(corners, triangles, 0, "stack")
    built.material[-1] = np.repeat([material for _, material in surfaces], 2)
    return built


def floor(built: Builder, material: int, z: float, half: float) -> Builder:
    corners = ((-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z))
    return built.quad(*corners, material, "floor")


def on_floor(device: Device, scene: Scene, photons: int = 1 << 17, **settings: Any) -> float:
    """The flux [W] that comes there by way of glass."""
    settings = {"width": 8, "height": 8, "passes": 1, "photon_bounces": 120} | settings
    with rendered(device, scene, photons=photons, **settings) as renderer:
        return float(fallen(renderer)[scene.surfaces.index("floor"), 0])


# Glass, water and glass, each above the next, as surfaces of relative indices: what is below is
# inside. Materials: air to glass, glass to water, water to glass, glass to air.
LAYERS = (glass(GLASS), glass(WATER / GLASS), glass(GLASS / WATER), glass(1.0 / GLASS))
STACK = ((0.3, 0), (0.2, 1), (0.1, 2), (0.0, 3))


@pytest.mark.stability(67)
def test_liquid_that_touches_glass(device: Device, measured: Measured) -> None:
    """Surface by surface, each of one relative index, head-on: photons, and the eye's rays."""
    faces = [reflected(1, GLASS), reflected(GLASS, WATER), reflected(WATER, GLASS)]
    exact = through([*faces, reflected(GLASS, 1)])
    built = floor(sheets(Builder(), *STACK, size=1.1), 4, -0.1, 1.0)
    found = on_floor(device, built.scene(DOWN, (SUN,), (*LAYERS, BLACK_WALL))) / 4.0
    assert measured("photons", abs(found / exact - 1.0), "%") <= 0.01
    built = floor(sheets(Builder(), *STACK), 4, -0.5, 30.0)
    seen = mean_of(
        device, built.scene(beam(np.array([0.0, 0.0, 1.0]), 0.5), (), (*LAYERS, EMISSIVE))
    )
    assert measured("eye's rays", float(np.abs(seen / exact - 1.0).max()), "%") <= 0.01


@pytest.mark.stability(67)
def test_liquid_shifts_what_is_below(device: Device, measured: Measured) -> None:
    """A narrow beam at 45 degrees: how far beside its straight way it lands, by Snell's law."""
    away = np.array([math.sqrt(0.5), 0.0, math.sqrt(0.5)])
    sun, places = sun_light("sun", WHITE, tuple(-away)), []
    for materials in ((0, 1, 2, 3), (5, 5, 5, 5)):
        surfaces = [(z, wears) for (z, _), wears in zip(STACK, materials, strict=True)]
        built = floor(sheets(Builder(), *surfaces), 4, -0.1, 4.0)
        for low, high in ((-4.0, 0.95), (1.05, 8.0)):  # light comes through a slit at x = 1
            built.quad((low, -4, 1), (high, -4, 1), (high, 4, 1), (low, 4, 1), 4, "blind")
        scene = built.scene(DOWN, (sun,), (*LAYERS, BLACK_WALL, glass(1.0)))
        settings = {"width": 8, "height": 8, "photons": 1 << 17, "photon_bounces": 4}
        with rendered(device, scene, **settings) as renderer:
            assert renderer.photons
            place, deposit = renderer.photons.mapper.deposits.arrays()
            on = place[:, 3].astype(int) - 1 == scene.surfaces.index("floor")
            x, weight = place[on, 0] * renderer.frame.scale, deposit[on, 0].astype(float)
            places.append((x * weight).sum() / weight.sum())
    bent = [math.tan(math.asin(math.sqrt(0.5) / index)) for index in (GLASS, WATER, GLASS)]
    exact = 0.1 * sum(1.0 - one for one in bent)
    assert measured("shift", abs((places[1] - places[0]) / -exact - 1.0), "%") <= 0.01


@pytest.mark.stability(67)
def test_fifty_surfaces(device: Device, measured: Measured, no_panes: None) -> None:
    """Twenty-five slabs, one behind the other: a stack of mirrors that let some through."""
    built, share = Builder(), reflected(1, GLASS)
    for number in range(25):
        low, high = 0.1 * number, 0.1 * number + 0.05
        built.box((-0.6, -0.6, low), (0.6, 0.6, high), 0)
    floor(built, 1, -0.1, 0.5)
    exact = through([share] * 50)
    scene = built.scene(DOWN, (SUN,), (glass(GLASS), BLACK_WALL))
    started = time.perf_counter()
    found = on_floor(device, scene, photons=1 << 16, photon_bounces=400)
    assert measured("50 surfaces", abs(found / exact - 1.0), "%") <= 0.03
    assert measured("seconds", time.perf_counter() - started) < 120.0


@pytest.mark.stability(67)
def test_totally_reflected(device: Device, measured: Measured) -> None:
    """A light in a ball of glass, out of its middle, and black beyond: what total reflection keeps
    goes round until bounces end, and no more comes out than went in."""
    ball = Builder().sphere((0, 0, 0), 1.0, 0, "ball", subdivisions=5)
    ball.box((-3, -3, -3), (3, 3, 3), 1, "floor")
    lamp = point_light("lamp", (0.0, 0.0, 0.9), (UNIT_INTENSITY,) * 3)
    scene = ball.scene(DOWN, (lamp,), (glass(GLASS), BLACK_WALL))
    few, many = (
        on_floor(device, scene, photons=1 << 15, photon_bounces=n) / UNIT_INTENSITY for n in (8, 64)
    )
    cosine = (np.arange(200_000) + 0.5) / 100_000 - 1.0  # of the way out, to the outward axis
    met = 0.9 * np.sqrt(1.0 - cosine**2)  # the sine of incidence, the same at every meeting
    share = fresnel(np.sqrt(1.0 - met**2), 1.0 / GLASS)
    for bounces, found in ((8, few), (64, many)):
        exact = float((1.0 - share**bounces).mean())
        assert measured(f"{bounces} bounces", abs(found / exact - 1.0), "%") <= 0.01
    assert few < many < 1.0


@pytest.mark.stability(68)
@pytest.mark.parametrize("ior", (1.0, 1.0001, 1.0 / 1.5))
def test_indices_about_one(device: Device, ior: float, measured: Measured, no_panes: None) -> None:
    """Index 1 is nothing there; a ball of air in glass spreads what a ball of glass gathers."""
    built = floor(Builder().box((-1.1, -1.1, 0), (1.1, 1.1, 0.1), 0), 1, -0.1, 1.0)
    scene = built.scene(DOWN, (SUN,), (glass(ior), BLACK_WALL))
    exact = 4.0 * through([reflected(1, ior)] * 2)
    found = on_floor(device, scene)
    assert measured("photons", abs(found / exact - 1.0), "%") <= 0.01
    built = floor(Builder().box((-2, -2, 0), (2, 2, 0.1), 0), 1, -0.5, 30.0)
    scene = built.scene(beam(np.array([0.0, 0.0, 1.0]), 0.5), (), (glass(ior), EMISSIVE))
    seen = mean_of(device, scene, passes=64 if ior < 1.0 else 4)
    assert measured("eye's rays", float(np.abs(4.0 * seen / exact - 1.0).max()), "%") <= 0.01


@pytest.mark.stability(69)
def test_light_in_closed_glass(device: Device, measured: Measured) -> None:
    """From the middle of a ball all that it does not reflect back comes out, sooner or later: a
    closed room about it is as bright as without it."""
    found = []
    for ior in (GLASS, 1.0):
        room = Builder().sphere((0, 0, 0), 0.3, 1, "bulb", subdivisions=4)
        room.sphere((0, 0, 0), 1.0, 0, "room", subdivisions=4)
        lamp = point_light("lamp", (0, 0, 0), (UNIT_INTENSITY,) * 3)
        view = camera((0, 0.7, 0), (0.0, 2.0, 0.1), 100)
        materials = plain_material("room", (0.5,) * 3), glass(ior)
        scene = room.scene(view, (lamp,), materials)
        settings = {"width": 16, "height": 16, "passes": 4, "photons": 1 << 16, "radius": 0.2}
        image = render_clean(device, scene, mirror_depth=16, photon_bounces=32, **settings)
        found.append(image["Combined"][..., :3].mean(dtype=float))
    assert found[1] == pytest.approx(1.0 / math.pi, rel=0.02)  # rho / (1 - rho) times E / pi
    assert measured("room about a lamp in glass", abs(found[0] / found[1] - 1.0), "%") <= 0.02


@pytest.mark.stability(69)
def test_camera_in_water(device: Device, measured: Measured) -> None:
    """It sees a wide floor in the same water as bright as the light there is, and no brighter: no
    index spreads what comes from it."""
    built = Builder().box((-6, -6, -0.4), (6, 6, 0), 1, "water")
    floor(built, 0, -0.3, 6.0)
    grey = plain_material("floor", (0.5,) * 3)
    scene = built.scene(camera((0, 0, -0.1), (0, 0, -0.3), 60), (SUN,), (grey, glass(WATER)))
    settings = {"width": 16, "height": 16, "passes": 8, "photons": 1 << 17, "radius": 1.0}
    image = render_clean(device, scene, mirror_depth=16, photon_bounces=32, **settings)
    seen = image["Combined"][..., :3].mean(dtype=float)
    # What the floor scatters comes back to it by the share that the surface reflects of it.
    cosine = np.sqrt((np.arange(100_000) + 0.5) / 100_000)
    back = float(fresnel(cosine, 1.0 / WATER).mean())
    exact = (1.0 - reflected(1, WATER)) / (1.0 - 0.5 * back) * 0.5 / math.pi
    assert measured("floor under water", abs(seen / exact - 1.0), "%") <= 0.02
