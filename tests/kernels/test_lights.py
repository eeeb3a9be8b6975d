# SPDX-License-Identifier: GPL-3.0-or-later
"""Every light of glsl/lights: samples by its density, what it emits by its profile, its flux, and
the irradiance that it brings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import GLOW, Light
from addon.photon.stage.emissive import TRIANGLE
from addon.photon.stage.kinds import light_kinds
from tests.kernels.conftest import Bench
from tests.kernels.light_probe import (
    COUNT,
    DENSITY,
    EMIT,
    FLUX,
    FRAME,
    SAMPLE,
    numbers,
    probe,
)
from tests.kernels.statistics import Cells, assert_density
from tests.kernels.test_seen_lights import SEEN_LIGHTS
from tests.scenes import plain_light

POWER = (8.0, 4.0, 2.0)
PLACE = np.array([0.3, 0.2, 0.1])  # in scene units
SKEW = (0.36, 0.48, -0.8)


def everywhere(light: Light, directions: Any) -> Any:
    return np.ones(len(directions))


def in_a_cone(light: Light, directions: Any) -> Any:
    """Blender's: full inside, and a smooth step to the edge."""
    outer, inner = light.parameters["outer"], light.parameters["inner"]
    axis = np.array(light.direction) / np.linalg.norm(light.direction)
    versine = ((directions - axis) ** 2).sum(axis=1) / 2
    t = np.clip((outer - versine) / max(outer - inner, 1e-30), 0, 1)
    return np.where(versine <= inner, 1.0, t * t * (3 - 2 * t))


@dataclass(frozen=True)
class Case:
    """What a kind emits into directions (n, 3), over P / (4 pi); and lights of it."""

    profile: Callable[[Light, Any], Any]
    lights: tuple[Light, ...]


def at_place(kind: str, **more: Any) -> Light:
    position = tuple(PLACE * FRAME.scale + FRAME.centre)
    return plain_light(kind.lower(), kind, position, POWER, SKEW, **more)


# A kind without an entry fails.
CASES = {
    "point": Case(everywhere, tuple(at_place("POINT", radius=r) for r in (0.0, 1e-3, 0.6))),
    "spot": Case(
        in_a_cone,
        tuple(
            at_place("SPOT", radius=r, spot_size=math.radians(size), spot_blend=blend)
            for size in (1, 70, 180)
            for blend in (0.0, 0.15, 1.0)
            for r in (0.0, 0.1)
        ),
    ),
}
EACH = [
    pytest.param(light, id=" ".join([kind, *(f"{x:.3g}" for x in light.parameters.values())]))
    for kind, case in CASES.items()
    for light in case.lights
]


def test_every_kind_is_tested() -> None:
    """Here, or where several kinds are held against each other, or in a file of their own."""
    seen = {light.kind for light in SEEN_LIGHTS} | {TRIANGLE, GLOW}
    assert CASES.keys() | seen == light_kinds().keys()


def emitted(bench: Bench, light: Light, seed: int = 11) -> tuple[Any, Any]:
    origin, direction = probe(bench, light, EMIT, *numbers(seed))
    assert np.abs(np.linalg.norm(direction[:, :3], axis=1) - 1).max() < 1e-6
    return origin[:, :3], direction[:, :3]


def axis_of(light: Light) -> NDArray[np.float64]:
    return np.array(light.direction) / np.linalg.norm(light.direction)


@pytest.mark.stability(32)
@pytest.mark.parametrize("light", EACH)
def test_emits_by_its_profile(one_bench: Bench, light: Light) -> None:
    """From its place, or its sphere outwards; in directions that go with the intensity."""
    profile = CASES[light.kind].profile
    origin, direction = emitted(one_bench, light, seed=12)
    cells = Cells(direction, axis_of(light))
    density = profile(light, cells.points)
    whole = cells.integral(density).sum()
    origin, direction = emitted(one_bench, light)
    assert_density(direction, cells, density / whole)
    radius = light.parameters["radius"] / FRAME.scale
    assert np.abs(np.linalg.norm(origin - PLACE, axis=1) - radius).max() < 1e-5 * radius + 1e-6
    cosine = ((origin - PLACE) * direction).sum(axis=1)
    assert cosine.min() >= -1e-5
    if radius > 0.01:  # even radiance: as many as the disc that is seen has area
        assert (cosine / radius).mean() == pytest.approx(2 / 3, abs=4 * math.sqrt(1 / 18 / COUNT))


@pytest.mark.parametrize("light", EACH)
def test_flux_is_what_is_emitted(one_bench: Bench, light: Light) -> None:
    """The integral of its intensity over all directions."""
    profile = CASES[light.kind].profile
    steps = np.linspace(0, 2.0, 200_001)
    if "outer" in light.parameters:
        steps = np.linspace(0, light.parameters["outer"], 200_001)
    versine = (steps[1:] + steps[:-1]) / 2
    side = np.cross(axis_of(light), (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    sine = np.sqrt(versine * (2 - versine))
    directions = sine[:, None] * side + (1 - versine)[:, None] * axis_of(light)
    solid = (profile(light, directions) * np.diff(steps)).sum() * 2 * np.pi
    expected = np.array(POWER) / FRAME.scale**2 * solid / (4 * np.pi)
    flux, _ = probe(one_bench, light, FLUX, np.zeros((1, 3)), np.zeros((1, 3)))
    np.testing.assert_allclose(flux[0, :3], expected, rtol=1e-5)


@pytest.mark.parametrize("light", EACH)
def test_directions_spread_with_the_first_number(one_bench: Bench, light: Light) -> None:
    """Stratified numbers stay stratified: the sampler is monotone."""
    u = np.zeros((10_000, 2))
    u[:, 0] = np.arange(10_000) / 10_000
    _, direction = probe(one_bench, light, EMIT, u, np.full((10_000, 2), 0.5))
    versine = ((direction[:, :3] - axis_of(light)) ** 2).sum(axis=1) / 2
    assert np.diff(versine).min() >= -1e-5 * versine.max()


def seen_from(light: Light, away: float) -> NDArray[np.float64]:
    """A place that lies `away` from the light, a little off its axis, in scene units."""
    tilt = 0.0
    if "outer" in light.parameters:  # in the middle of what is lit
        tilt = 0.3 * math.acos(1 - light.parameters["outer"])
    across = np.cross(axis_of(light), (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    made: NDArray[np.float64] = PLACE + away * (
        math.cos(tilt) * axis_of(light) + math.sin(tilt) * across
    )
    return made


@pytest.mark.parametrize("away", [0.5, 3.0])
@pytest.mark.parametrize("light", EACH)
def test_samples_have_the_density(one_bench: Bench, light: Light, away: float) -> None:
    """Rays to a sphere, which end on it, by their density; to a point there is one, of none."""
    place, radius = seen_from(light, away), light.parameters["radius"] / FRAME.scale
    to_middle = (PLACE - place) / away
    many = np.broadcast_to(place, (COUNT, 3))
    found, _ = probe(one_bench, light, SAMPLE, many, numbers()[0])
    directions, far = found[:, :3], found[:, 3]
    assert np.abs(np.linalg.norm(directions, axis=1) - 1).max() < 1e-5
    met = place + directions * far[:, None]
    off = np.linalg.norm(met - PLACE, axis=1) - radius
    assert np.abs(off).max() < 5e-4 * radius + 1e-5
    assert ((met - PLACE) @ -to_middle).min() > -1e-5  # on the near side
    if radius == 0:
        density, _ = probe(one_bench, light, DENSITY, many[:1], directions[:1])
        assert not density.any() and np.ptp(directions, axis=0).max() == 0
        np.testing.assert_allclose(directions[0], to_middle, atol=1e-6)
        return
    sample, _ = probe(one_bench, light, SAMPLE, many, numbers(12)[0])
    cells = Cells(sample[:, :3], to_middle)
    of_points = np.broadcast_to(place, cells.points.shape)
    density, _ = probe(one_bench, light, DENSITY, of_points, cells.points)
    assert_density(directions, cells, density[:, 0])


@pytest.mark.parametrize("away", [0.5, 3.0])
@pytest.mark.parametrize("light", EACH)
def test_irradiance(one_bench: Bench, light: Light, away: float) -> None:
    """At a place that faces the middle of a sphere as a whole, light is that of a point there:
    I / d^2, and times the cosine on a floor that it rises above."""
    place = seen_from(light, away)
    to_middle = (PLACE - place) / away
    found, brought = probe(
        one_bench, light, SAMPLE, np.broadcast_to(place, (COUNT, 3)), numbers()[0]
    )
    intensity = np.array(POWER) / FRAME.scale**2 / (4 * np.pi)
    across = np.cross(to_middle, (1.0, 0.0, 0.0))
    for tilt in (0.0, 0.4):
        floor = math.cos(tilt) * to_middle + math.sin(tilt) * across / np.linalg.norm(across)
        cosine = found[:, :3] @ floor
        assert cosine.min() > 0
        each = brought[:, :3] * (brought[:, 3:] * cosine[:, None])
        error = 4 * each.std(axis=0) / math.sqrt(COUNT)
        expected = intensity / away**2 * math.cos(tilt)
        profile = CASES[light.kind].profile(light, -found[:, :3])
        # Every ray brings what the profile lets out towards it; at a hard edge either.
        assert (np.abs(brought[:, 3] - profile) > 2e-3).mean() < 1e-4
        if profile.min() == profile.max():
            expected = expected * profile[0]
            assert (np.abs(each.mean(axis=0) - expected) <= error + 1e-4 * expected).all()


def test_lit_from_all_around_inside_a_sphere(one_bench: Bench) -> None:
    """As in Cycles, a spotlight too."""
    for light in (CASES["point"].lights[2], CASES["spot"].lights[3]):
        inside = replace(light, parameters={**light.parameters, "radius": 1.0})
        place = np.broadcast_to(PLACE + np.array([0.1, 0.0, 0.0]), (COUNT, 3))
        found, brought = probe(one_bench, inside, SAMPLE, place, numbers()[0])
        each = brought[:, :3] * (brought[:, 3:] * found[:, 2:3])
        np.testing.assert_allclose(
            each, np.tile(np.divide(POWER, 4 * np.pi), (COUNT, 1)), rtol=1e-4
        )
        met = place + found[:, :3] * found[:, 3:] - PLACE
        np.testing.assert_allclose(np.linalg.norm(met, axis=1) * FRAME.scale, 1.0, rtol=1e-5)


@pytest.mark.parametrize("light", EACH)
def test_always_finite(bench: Bench, light: Light) -> None:
    """From anywhere, the light's middle too; for the ends of numbers. `probe` looks at it."""
    places = np.concatenate(
        [
            PLACE + np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]) * size
            for size in (1e-20, 1e-6, 0.05, 0.3, 1.0, 1e3)
        ]
    )
    ends = np.array([0.0, 1.0 / (1 << 24), 0.5, 1.0 - 1.0 / (1 << 24)])
    u = np.stack(np.meshgrid(ends, ends), -1).reshape(-1, 2)
    many = np.repeat(places, len(u), axis=0)
    _, brought = probe(bench, light, SAMPLE, many, np.tile(u, (len(places), 1)))
    assert brought.min() >= 0
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    many = np.repeat(places, len(directions), axis=0)
    density, _ = probe(bench, light, DENSITY, many, np.tile(directions, (len(places), 1)))
    assert density.min() >= 0
    probe(bench, light, EMIT, np.repeat(u, len(u), axis=0), np.tile(u, (len(u), 1)))
