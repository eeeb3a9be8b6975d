# SPDX-License-Identifier: GPL-3.0-or-later
"""What media emit, by closed forms: seen, reflected, by shadow rays, by photons, and scattered."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.scene import BLACK, Lobe, Material, Medium, Scene, world_light
from addon.streams import Device
from tests.measure import fallen, rendered
from tests.physics.test_media import (
    BACKENDS,
    EMISSIVE,
    ENDLESS,
    WALL,
    WHITE,
    from_above,
    holding,
    mean_of,
)
from tests.physics.test_varying_media import UP, along
from tests.scenes import Builder, plain_material

GLOW = (3.0, 1.0, 0.5)
MIRROR = Material("mirror", BLACK, (Lobe("mirror", (0.5, 0.8, 1.0)),))


def shining(medium: Medium) -> Medium:
    """It emits what it scatters, in place of that."""
    return replace(medium, emission=medium.scattering, scattering=BLACK)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("absorbs", ((0.0, 1e-4, 2.0), (0.5, 20.0, 0.003)))
def test_what_is_seen_of_it(device: Device, backend: str, absorbs: Any) -> None:
    """E (1 - exp(-a d)) / a of a slab, and what it leaves of what is behind."""
    deep, lost = 1.2, np.array(absorbs)
    built = Builder().box((-9, -9, 0.5), (9, 9, 0.5 + deep), 0)
    built.quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 1)
    medium = Medium(absorbs, emission=GLOW)
    found = mean_of(
        device, built.scene(from_above(), (), (holding(medium), EMISSIVE)), backend=backend
    )
    way = np.where(lost > 0.0, -np.expm1(-lost * deep) / np.maximum(lost, 1e-30), deep)
    assert found == pytest.approx(GLOW * way + np.exp(-lost * deep), rel=1e-4)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_seen_where_it_differs(device: Device, backend: str) -> None:
    """Denser and brighter further up: of E z and a z what an even one has."""
    deep, absorbs = 1.2, (0.2, 0.5, 3.0)
    medium = shining(along(UP, absorbs=absorbs, scatters=GLOW))
    built = Builder().box((-9, -9, 0), (9, 9, deep), 0)
    found = mean_of(device, built.scene(from_above(), (), (holding(medium),)), backend=backend)
    lost = np.array(absorbs)
    assert found == pytest.approx(GLOW * -np.expm1(-lost * deep**2 / 2) / lost, rel=2e-3)


def above_floor(medium: Medium, floor: Material) -> Scene:
    """A ball of a radius of 0.5, 1.5 m above what a camera in between looks at."""
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 1)
    built.sphere((0, 0, 1.5), 0.5, 0, subdivisions=4)
    return built.scene(from_above(0.02, 0.9), (), (holding(medium), floor))


@pytest.mark.thorough("True-True")
@pytest.mark.parametrize("varies", (False, True))
@pytest.mark.parametrize("photons", (False, True))
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_it_lights(device: Device, backend: str, photons: bool, varies: bool) -> None:
    """Of a ball E 4/3 pi r^3 / d^2: as if all came from its middle, by Newton's shell theorem.
    Photons blur it."""
    even = Medium(emission=GLOW)
    medium = shining(along((0.0, 0.0, 0.0, 1.0), scatters=GLOW)) if varies else even
    scene = above_floor(medium, plain_material("grey", (0.5,) * 3))
    settings: dict[str, Any] = {"passes": 64, "width": 16, "height": 16}
    if photons:
        settings |= {"photons": 1 << 16, "direct_by_photons": True, "passes": 16}
    found = mean_of(device, scene, backend=backend, **settings)
    lit = np.array(GLOW) * 4.0 / 3.0 * math.pi * 0.5**3 / 1.5**2
    assert found == pytest.approx(0.5 / math.pi * lit, rel=0.04 if photons else 0.006)


@pytest.mark.thorough("0.05")
@pytest.mark.parametrize("rough", (0.0, 0.05, 0.7))
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_lobes_show_of_it(device: Device, backend: str, rough: float) -> None:
    """As bright as E / a all about where it is deep. What a lobe gathers with shows what rays
    do."""
    medium = Medium((6.0, 4.0, 5.0), emission=GLOW)
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 1)
    built.box((-2, -2, 1.0), (2, 2, 3.0), 0)
    floor = MIRROR
    if rough:
        shape = {"alpha_x": rough, "alpha_y": rough, "turn": 0.0, "compensated": 1.0}
        floor = Material("metal", BLACK, (Lobe("ggx", (0.5, 0.8, 1.0), shape),))
    scene = built.scene(from_above(0.02, 0.9), (), (holding(medium), floor))
    settings = {"backend": backend, "passes": 96, "width": 16, "height": 16}
    found = mean_of(device, scene, photons=1000, **settings)
    expected: Any = np.array(GLOW) / medium.absorption * (0.5, 0.8, 1.0)
    if rough > 0.5:
        expected = mean_of(device, scene, photons=0, **settings)
    assert found == pytest.approx(expected, rel=0.03 if rough else 1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("scatters", (BLACK, (2.0, 0.5, 1.0)))
def test_it_is_not_seen_in_equilibrium(device: Device, backend: str, scatters: Any) -> None:
    """It emits what it absorbs of the world's radiance of 1, which is 1 all through then."""
    absorbs = (0.5, 2.0, 1.0)
    built = Builder().sphere((0, 0, 0), 1.0, 0)
    medium = Medium(absorbs, scatters, 0.3, absorbs)
    if not any(scatters):  # denser further up
        medium = shining(along((0.0, 0.0, 1.0, 1.0), absorbs=absorbs, scatters=absorbs))
    scene = built.scene(from_above(2.4), (world_light("World", WHITE),), (holding(medium),))
    found = mean_of(device, scene, backend=backend, passes=48, **ENDLESS)
    assert found == pytest.approx(1.0, rel=0.015)


@pytest.mark.parametrize("backend", BACKENDS)
def test_photons_of_it(device: Device, backend: str) -> None:
    """All of its flux falls on walls about it."""
    built = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=4)
    built.box((-0.3, -0.2, -0.1), (0.3, 0.2, 0.1), 1)
    scene = built.scene(from_above(0.5, 0.9), (), (WALL, holding(Medium(emission=GLOW))))
    settings = {"photons": 1 << 16, "width": 8, "height": 8, "backend": backend}
    with rendered(device, scene, direct_by_photons=True, **settings) as renderer:
        found = fallen(renderer).sum(axis=0)
    assert found == pytest.approx(4.0 * math.pi * np.array(GLOW) * 0.048, rel=1e-3)


def test_what_is_everywhere_emits_nothing() -> None:
    scene = replace(above_floor(Medium(emission=GLOW), WALL), air=Medium(emission=GLOW))
    with pytest.raises(SceneError, match=r"scene\.air: what is everywhere emits nothing"):
        scene.check()
