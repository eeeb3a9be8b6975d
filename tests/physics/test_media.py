# SPDX-License-Identifier: GPL-3.0-or-later
"""What media absorb and scatter, inside meshes and everywhere, by closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import (
    ALL_RAYS,
    BLACK,
    RAY_BITS,
    Lobe,
    Material,
    Medium,
    Scene,
    point_light,
    sun_light,
    world_light,
)
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.physics.test_glass import glass
from tests.scenes import Builder, camera, orthographic, plain_material

WHITE = (1.0, 1.0, 1.0)
FOG = Medium((0.2, 0.5, 0.0), (1.0, 0.5, 2.0))
THIN = Medium((0.002, 0.0, 0.001), (0.003, 0.0005, 0.002))
EMISSIVE = Material("emissive", BLACK, emission=WHITE)
WALL = plain_material("wall", (1e-4,) * 3)  # takes photons, and sends none on
# Which let programs know rays of lobes, and light from behind.
SHAPE = {"alpha_x": 0.1, "alpha_y": 0.1, "turn": 0.0, "compensated": 1.0}
SHINY = Material("shiny", (0.1,) * 3, (Lobe("ggx", (0.5,) * 3, SHAPE),))
LEAF = Material("leaf", (0.1,) * 3, (Lobe("translucent", (0.5,) * 3),))
ENDLESS: dict[str, Any] = {"volume_bounces": 200, "mirror_depth": 400, "transparent_depth": 1000}
BACKENDS = ("native", "compute", "fragment")


def holding(medium: Medium) -> Material:
    """A material without any surface, with a medium inside."""
    return Material("fog", BLACK, (Lobe("transparent", WHITE),), medium=medium)


def extinction(medium: Medium) -> NDArray[np.float64]:
    """[1/m]"""
    return np.add(medium.absorption, medium.scattering)


def henyey_greenstein(g: float, cosine: float) -> float:
    """[1/sr]"""
    return (1.0 - g * g) / (4.0 * math.pi * (1.0 + g * g - 2.0 * g * cosine) ** 1.5)


def from_above(size: float = 0.5, height: float = 6.0) -> Any:
    return orthographic((0, 0, height), (1.0, 0, 0), (0, 1.0, 0), size)


def mean_of(device: Device, scene: Scene, **settings: Any) -> Any:
    """The picture's, per channel."""
    settings = {"width": 32, "height": 32, "passes": 16, "photons": 0} | settings
    return render(device, scene, **settings)["Combined"][..., :3].mean(axis=(0, 1), dtype=float)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("medium", "g"), ((FOG, 0.0), (FOG, 0.7), (FOG, -0.5), (THIN, 0.3)))
def test_slab_that_scatters_once(device: Device, backend: str, medium: Medium, g: float) -> None:
    """Sunlight from 40 degrees: scattering p E integral exp(-extinction (1 + 1 / cos) x) dx."""
    cosine, deep = math.cos(math.radians(40)), 0.8
    sun = sun_light("sun", WHITE, (math.sin(math.radians(40)), 0.0, -cosine))
    medium = replace(medium, anisotropy=g)
    built = Builder().box((-40, -40, 0), (40, 40, deep), 0)
    built.box((50, 50, 0), (51, 51, 1), 1).box((60, 60, 0), (61, 61, 1), 2)  # not seen
    scene = built.scene(from_above(), (sun,), (holding(medium), SHINY, LEAF))
    lost = extinction(medium) * (1.0 + 1.0 / cosine)
    phase = henyey_greenstein(g, -cosine)
    expected = np.array(medium.scattering) * phase * (1.0 - np.exp(-lost * deep)) / lost
    found = mean_of(device, scene, backend=backend, passes=64)
    assert found == pytest.approx(expected, rel=0.01)


def in_box(scene: Builder, medium: Medium) -> dict[str, Any]:
    scene.box((-30, -30, -1), (30, 30, 9), 1)
    return {"materials": (EMISSIVE, holding(medium))}


def everywhere(scene: Builder, medium: Medium) -> dict[str, Any]:
    return {"materials": (EMISSIVE,), "air": medium}


@pytest.mark.parametrize("where", (in_box, everywhere))
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_seen_through_it(
    device: Device, backend: str, where: Callable[..., dict[str, Any]]
) -> None:
    """exp(-extinction way) of what a surface emits, where the camera is inside."""
    medium = Medium((0.05, 0.2, 0.4))
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    scene = built.scene(from_above(height=3.0), (), **where(built, medium))
    found = mean_of(device, scene, backend=backend)
    assert found == pytest.approx(np.exp(-3.0 * extinction(medium)), rel=1e-4)


@pytest.mark.parametrize("where", (in_box, everywhere))
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_lamps_bring_through_it(
    device: Device, backend: str, where: Callable[..., dict[str, Any]]
) -> None:
    """Of a lamp inside, to a plate below and on to the camera; what is scattered is apart."""
    medium = Medium((0.1, 0.3, 0.6))
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    more = where(built, medium)
    grey = plain_material("grey", (0.5,) * 3)
    lamp = point_light("lamp", (0.0, 0.0, 2.0), (4.0 * math.pi,) * 3, 0.0)
    more["materials"] = (grey, *more["materials"][1:])
    scene = built.scene(from_above(0.02, 3.0), (lamp,), **more)
    found = mean_of(device, scene, backend=backend)
    clear = 0.5 / math.pi / 4.0
    assert found == pytest.approx(clear * np.exp(-5.0 * extinction(medium)), rel=1e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_world_beside_an_open_mesh(device: Device, backend: str) -> None:
    """A floor below a small plate that holds a medium: what comes through the plate is less by exp(
    -extinction way), what comes in at its sides is not, for that medium would not end."""
    medium, high, half = Medium((0.4, 1.0, 3.0)), 0.5, 0.4
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    built.quad(
        (-half, -half, high), (half, -half, high), (half, half, high), (-half, half, high), 1
    )
    materials = plain_material("grey", (0.5,) * 3), holding(medium)
    scene = built.scene(from_above(0.02), (world_light("world", WHITE),), materials)
    at = half * ((np.arange(200) + 0.5) / 100.0 - 1.0)
    way = np.sqrt(at[:, None] ** 2 + at[None] ** 2 + high**2)
    factor = high**2 / way**4 / math.pi * (half / 100.0) ** 2  # of each part of the plate
    through = np.exp(-way[..., None] * extinction(medium))
    irradiance = 1.0 - (factor[..., None] * (1.0 - through)).sum(axis=(0, 1))  # over pi
    found = mean_of(device, scene, backend=backend, passes=64)
    expected = 0.5 * irradiance * np.exp(-high * extinction(medium))
    assert found == pytest.approx(expected, rel=0.01)


@pytest.mark.thorough("-0.0")
@pytest.mark.parametrize("g", (0.0, 0.6))
@pytest.mark.parametrize("backend", BACKENDS)
def test_nothing_is_lost_in_white_fog(device: Device, backend: str, g: float) -> None:
    """Where nothing is absorbed, a ball in a world of one radiance can't be seen."""
    white = Medium(BLACK, (3.0, 1.0, 5.0), g)
    scene = (
        Builder()
        .sphere((0, 0, 0), 1.0, 0)
        .scene(from_above(2.4), (world_light("World", WHITE),), (holding(white),))
    )
    found = mean_of(device, scene, backend=backend, passes=48, **ENDLESS)
    assert found == pytest.approx(1.0, rel=0.01)


@pytest.mark.thorough
def test_nothing_is_lost_behind_panes(device: Device) -> None:
    """Light through glass comes by rays that fog scatters alone, and not by shadow rays again."""
    white = Medium(BLACK, (3.0, 1.0, 5.0))
    built = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=3)
    for low in (-1.6, 1.5):
        built.box((-50, -50, low), (50, 50, low + 0.1), 1)
    built.quad((60, 60, 0), (61, 60, 0), (61, 61, 0), (60, 61, 0), 2)  # for photons, not seen
    materials = holding(white), glass(1.0), WALL
    view = camera((0, -4, 0), (0, 0, 0), 20)
    scene = built.scene(view, (world_light("World", WHITE),), materials)
    found = mean_of(device, scene, passes=48, photons=1000, **ENDLESS)
    assert found == pytest.approx(1.0, rel=0.015)


def test_shiny_floors_in_fog(device: Device) -> None:
    """Where all lobes gather photons rays go on in fog all the same: more light at each bounce."""
    floor = Material("floor", BLACK, (Lobe("phong", (0.5,) * 3, {"exponent": 1.0}),))
    lamp = point_light("lamp", (0.0, 0.0, 2.0), (10.0,) * 3)
    scene = (
        Builder()
        .quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
        .scene(
            camera((0, -6, 1.5), (0, 0, 1.5), 50), (lamp,), (floor,), air=Medium(BLACK, (0.15,) * 3)
        )
    )
    settings = {"photons": 20000, "passes": 8}
    once, often = (mean_of(device, scene, volume_bounces=n, **settings) for n in (0, 6))
    assert (often > 1.5 * once).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_photons_in_what_absorbs(device: Device, backend: str) -> None:
    """From a lamp in it to the walls of a ball about that: exp(-extinction radius) of its flux."""
    medium = Medium((0.3, 1.0, 2.0))
    lamp = point_light("lamp", (0.0, 0.0, 0.0), WHITE)
    built = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=5)
    scene = built.scene(from_above(0.5, 0.9), (lamp,), (WALL,), air=medium)
    settings = {"photons": 1 << 16, "width": 8, "height": 8, "backend": backend}
    with rendered(device, scene, direct_by_photons=True, **settings) as renderer:
        found = fallen(renderer).sum(axis=0)
    assert found == pytest.approx(np.exp(-extinction(medium)), rel=0.005)


@pytest.mark.parametrize("backend", BACKENDS)
def test_alpha_depth_and_holdouts(device: Device, backend: str) -> None:
    """What fog takes is opaque; depth is that of the surface behind it, or of none."""
    medium = Medium((0.01,) * 3, (0.03,) * 3)
    hole = replace(WALL, holdout=True)
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    for material, expected in ((hole, 1.0 - math.exp(-0.04 * 5.0)), (WALL, 1.0)):
        scene = built.scene(from_above(0.5, 5.0), (), (material,), air=medium)
        settings = {"passes": 64, "photons": 0, "backend": backend, "transparent": True}
        images = render(device, scene, **settings)
        assert images["Combined"][..., 3].mean() == pytest.approx(expected, abs=0.005)
        assert images["Depth"] == pytest.approx(5.0, rel=1e-3)


def test_what_eyes_and_lamps_are_in_is_visible_to_them(device: Device) -> None:
    """A box that camera rays pass holds nothing for a camera in it."""
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    materials = in_box(built, Medium((1.0,) * 3))["materials"]
    scene = built.scene(from_above(height=3.0), (), materials)
    hidden = np.array([ALL_RAYS, ALL_RAYS - RAY_BITS["camera"]], np.uint8)
    for visible, expected in ((hidden, 1.0), (scene.visible, math.exp(-3.0))):
        found = mean_of(device, replace(scene, visible=visible))
        assert found == pytest.approx(expected, rel=1e-4)


def test_five_deep(device: Device) -> None:
    """Of boxes in one another four count."""
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    media = [Medium((0.1 * number,) * 3) for number in range(1, 6)]
    for number in range(5):
        low, high = -20.0 - number, 20.0 + number
        built.box((low, low, -5.0), (high, high, 1.0 + 0.1 * (5 - number)), 1 + number)
    materials = (EMISSIVE, *map(holding, media))
    found = mean_of(device, built.scene(from_above(height=3.0), (), materials))
    tops = [1.0 + 0.1 * (5 - number) for number in range(5)]
    order = sorted(range(5), key=lambda number: -tops[number])[:4]
    lost = sum(media[number].absorption[0] * tops[number] for number in order)
    assert found == pytest.approx(math.exp(-lost), rel=1e-3)


def exponential_2(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """E_2, integral over mu in (0, 1) of exp(-x / mu)."""
    mu = (np.arange(4000) + 0.5) / 4000
    return np.exp(-x[:, None] / mu).mean(axis=1)


@pytest.mark.parametrize("backend", BACKENDS)
def test_photons_that_fog_scatters_land(device: Device, backend: str) -> None:
    """Of sunlight through a slab the flux that one scattering sends down, and no other lands."""
    deep, steps = 0.8, 400
    sun = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
    built = Builder().box((-20, -20, 0.001), (20, 20, deep), 0)
    built.quad((-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0), 1)
    scene = built.scene(from_above(30.0), (sun,), (holding(FOG), WALL))
    x = (np.arange(steps) + 0.5) * deep / steps
    lost = extinction(FOG)
    expected = [
        s * deep / steps * (np.exp(-e * x) * exponential_2(e * (deep - x)) / 2).sum()
        for s, e in zip(FOG.scattering, lost, strict=True)
    ]
    settings = {"photons": 1 << 18, "passes": 1, "width": 8, "height": 8, "backend": backend}
    with rendered(device, scene, **settings) as renderer:
        found = fallen(renderer)[1] / 40**2
    assert found == pytest.approx(np.array(expected) * 0.98, rel=0.03)  # some leaves at the sides
