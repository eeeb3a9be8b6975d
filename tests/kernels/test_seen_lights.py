# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that are seen: what a ray sees of one, its samples, its density, its photons and its flux
are of one light, whatever its kind."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import (
    BLACK,
    Light,
    Material,
    area_light,
    environment_light,
    point_light,
    spot_light,
    sun_light,
    world_light,
)
from addon.photon.stage.emissive import Emission, emissive_triangles, triangle_lights
from addon.photon.stage.geometry import Mesh
from tests.kernels.conftest import Bench
from tests.kernels.light_probe import (
    BOUNDS,
    CARRIED,
    COUNT,
    DENSITY,
    EMIT,
    FLUX,
    FRAME,
    SAMPLE,
    SEEN,
    numbers,
    probe,
)
from tests.kernels.statistics import Cells, assert_density
from tests.scenes import Builder, camera, plain_light

POWER = (8.0, 4.0, 2.0)
SKEW = (0.36, 0.48, -0.8)
MIDDLE = np.array([0.1, 0.2, 0.6])  # of lights that have one, in scene units
PLACE = np.array([0.3, 0.2, -0.3])
NORMAL = np.array([0.48, -0.36, 0.8])
FAR = 3e38
SIGMAS = 4.5


def at_scene(middle: Any) -> tuple[float, float, float]:
    """A place [scene units] in metres."""
    x, y, z = np.asarray(middle) * FRAME.scale + FRAME.centre
    return float(x), float(y), float(z)


SEEN_LIGHTS = (
    plain_light("point", "POINT", at_scene(MIDDLE), POWER, radius=0.8),
    plain_light("spot", "SPOT", at_scene(MIDDLE), POWER, SKEW, 0.6, math.radians(140), 0.4),
    point_light("soft point", at_scene(MIDDLE), POWER, 1.6, soft=True),
    spot_light(
        "stretched",
        at_scene(MIDDLE),
        POWER,
        SKEW,
        size=math.radians(120),
        blend=0.4,
        radius=0.6,
        across=(1.0, 0.2, 0.5),
        stretch=(1.8, 0.7),
    ),
    *(
        area_light(
            name,
            at_scene(MIDDLE),
            POWER,
            SKEW,
            (1.0, 0.2, 0.5),
            size=size,
            is_round=r,
            spread=spread,
        )
        for name, size, r, spread in (
            ("square", (2.0, 2.0), False, math.pi),
            ("strip", (3.0, 1.0), False, math.pi),
            ("ellipse", (2.5, 1.0), True, math.pi),
            ("softbox", (2.0, 3.0), False, math.radians(100)),
            ("soft disc", (2.0, 2.0), True, math.radians(100)),
        )
    ),
    sun_light("sun", POWER, SKEW, math.radians(20)),
    sun_light("wide sun", POWER, SKEW, math.radians(180)),
    world_light("world", POWER),
    environment_light("environment", 0, POWER, SKEW, (0.6, -0.8, 0.0)),
)


def emissive_triangle() -> NDArray[Any]:
    """Across the middle, seen from below at a slant, larger than what is sampled by area."""
    b = Builder().add([[0, 0, 0], [1.6, 0.2, 0.1], [0.3, 1.4, -0.2]], [[0, 1, 2]])
    emitter = Material("emissive", BLACK, (), POWER)
    scene = b.scene(camera((0, 0, 0), (1, 1, 1), 40), [], [emitter])
    scene = replace(scene, vertices=scene.vertices + at_scene(MIDDLE - 0.25))
    mesh = Mesh.build(scene, FRAME)
    emission = np.array([material.emission for material in scene.materials])
    radiance = emission[scene.material[emissive_triangles(scene, mesh)]]
    return triangle_lights(scene, mesh, Emission.even(radiance))


EACH = [pytest.param(light, id=light.name) for light in SEEN_LIGHTS]
EACH.append(pytest.param(emissive_triangle(), id="triangle"))


def directions_above(normal: NDArray[Any], u: NDArray[Any]) -> NDArray[Any]:
    """By the cosine."""
    side = np.cross(normal, (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    radius, turn = np.sqrt(u[:, :1]), 2 * np.pi * u[:, 1:]
    up = np.sqrt(1 - u[:, :1])
    flat = np.cos(turn) * side + np.sin(turn) * np.cross(normal, side)
    made: NDArray[Any] = radius * flat + up * normal
    return made


def seen_irradiance(bench: Bench, light: Light, places: Any) -> tuple[Any, Any]:
    """By rays over the hemisphere, and the standard error."""
    directions = directions_above(NORMAL, numbers(21)[0])
    rays = np.concatenate([places, np.full((COUNT, 1), FAR)], axis=1)
    seen, _ = probe(bench, light, SEEN, rays, directions)
    radiance = np.pi * seen[:, :3]
    return radiance.mean(axis=0), radiance.std(axis=0) / math.sqrt(COUNT)


def sampled_irradiance(bench: Bench, light: Light, places: Any) -> tuple[Any, Any]:
    found, brought = probe(bench, light, SAMPLE, places, numbers(22)[0], NORMAL)
    cosine = np.maximum(found[:, :3] @ NORMAL, 0.0)
    each = brought[:, :3] * (brought[:, 3:] * cosine[:, None])
    return each.mean(axis=0), each.std(axis=0) / math.sqrt(COUNT)


def assert_equal(a: tuple[Any, Any], b: tuple[Any, Any], rtol: float = 1e-4) -> None:
    error = np.hypot(a[1], b[1])
    assert (error < 0.02 * a[0]).all()  # or the test would tell nothing
    assert (np.abs(a[0] - b[0]) <= SIGMAS * error + rtol * a[0]).all(), (a, b)


@pytest.mark.parametrize("light", EACH)
def test_samples_bring_what_is_seen(one_bench: Bench, light: Light) -> None:
    many = np.broadcast_to(PLACE, (COUNT, 3))
    seen, sampled = (f(one_bench, light, many) for f in (seen_irradiance, sampled_irradiance))
    assert_equal(seen, sampled)


@pytest.mark.parametrize("light", EACH)
def test_a_sample_brings_what_its_ray_sees_over_its_density(one_bench: Bench, light: Light) -> None:
    many = np.broadcast_to(PLACE, (COUNT, 3))
    found, brought = probe(one_bench, light, SAMPLE, many, numbers(23)[0], NORMAL)
    directions, far = found[:, :3], found[:, 3]
    just = np.concatenate([many, np.minimum(far * 1.001, FAR)[:, None]], axis=1)
    seen, _ = probe(one_bench, light, SEEN, just, directions)
    density, _ = probe(one_bench, light, DENSITY, many, directions, NORMAL)
    inside = (density[:, 0] > 0) & (brought[:, 3] > 0)
    assert inside.mean() > 0.3
    np.testing.assert_allclose(
        brought[inside, :3] * brought[inside, 3:],
        seen[inside, :3] / density[inside, :1],
        rtol=5e-3,
        atol=1e-4 * brought[..., :3].max(),
    )
    # What stands before it hides it.
    hidden = np.concatenate([many, (np.minimum(far, 10.0) * 0.9)[:, None]], axis=1)
    seen, _ = probe(one_bench, light, SEEN, hidden, directions)
    assert not seen[:, :3].any()


@pytest.mark.parametrize("light", EACH)
def test_samples_have_the_density(one_bench: Bench, light: Light) -> None:
    many = np.broadcast_to(PLACE, (COUNT, 3))
    found = (
        probe(one_bench, light, SAMPLE, many, numbers(seed)[0], NORMAL)[0] for seed in (24, 25)
    )
    first, second = (each[each[:, 3] > 0, :3] for each in found)  # some find no light
    middle = first.mean(axis=0) / np.linalg.norm(first.mean(axis=0))
    cells = Cells(second, middle)
    of_points = np.broadcast_to(PLACE, cells.points.shape)
    density, _ = probe(one_bench, light, DENSITY, of_points, cells.points, NORMAL)
    assert_density(first, cells, density[:, 0], len(first) / COUNT)


# Of lamps of a size one of each shape; tests/physics/test_lamps.py sees photons of the others.
@pytest.mark.thorough("strip", "soft disc", "softbox", "stretched", "soft point")
@pytest.mark.parametrize("light", EACH)
def test_photons_bring_what_samples_bring(one_bench: Bench, light: Light) -> None:
    """Through a disc; and all together they are the flux."""
    radius = 0.3
    u, turn = numbers(26)[0].T
    side = np.cross(NORMAL, (1.0, 0.0, 0.0)) / np.linalg.norm(np.cross(NORMAL, (1.0, 0.0, 0.0)))
    flat = np.cos(2 * np.pi * turn)[:, None] * side
    flat += np.sin(2 * np.pi * turn)[:, None] * np.cross(NORMAL, side)
    places = PLACE + radius * np.sqrt(u)[:, None] * flat
    sampled = sampled_irradiance(one_bench, light, places)
    flux, _ = probe(one_bench, light, FLUX, np.zeros((1, 3)), np.zeros((1, 3)))
    landed, many, carried = 0, 0, []
    for seed in range(30, 38):
        emitted, direction = probe(one_bench, light, EMIT, *numbers(seed))
        origin, weight, direction = emitted[:, :3], emitted[:, 3], direction[:, :3]
        falling = direction @ NORMAL
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (PLACE - origin) @ NORMAL / falling
        met = origin + direction * t[:, None]
        lands = (falling < 0) & (t > 0) & (np.linalg.norm(met - PLACE, axis=1) < radius)
        back = np.concatenate([met, np.full((COUNT, 1), FAR)], axis=1)[lands]
        seen, _ = probe(one_bench, light, SEEN, back, -direction[lands])
        is_soft = isinstance(light, Light) and light.parameters.get("soft")
        assert is_soft or (seen[:, 3] > 0).mean() > 0.999
        each = probe(one_bench, light, CARRIED, direction, direction)[0][:, :3]
        # What an image emits, which only says how many photons start there, is summed by pixels.
        np.testing.assert_allclose(each.mean(axis=0), flux[0, :3], 2e-2)
        counts = np.zeros(COUNT)
        counts[lands] = weight[lands] * (seen[:, 3] > 0)
        landed += int(lands.sum())
        many += COUNT
        carried.append(each * counts[:, None] / (np.pi * radius**2))
    brought = np.concatenate(carried)
    assert landed > 5000
    assert_equal(sampled, (brought.mean(axis=0), brought.std(axis=0) / math.sqrt(many)))


@pytest.mark.thorough("compute")  # the same text
@pytest.mark.parametrize("light", EACH)
def test_always_finite(bench: Bench, light: Light) -> None:
    """From anywhere, for the ends of numbers. `probe` looks at it."""
    places = np.concatenate(
        [
            MIDDLE + np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]) * size
            for size in (1e-20, 1e-6, 0.05, 0.3, 1.0, 1e3)
        ]
    )
    ends = np.array([0.0, 1.0 / (1 << 24), 0.5, 1.0 - 1.0 / (1 << 24)])
    u = np.stack(np.meshgrid(ends, ends), -1).reshape(-1, 2)
    for normal in np.concatenate([np.eye(3), -np.eye(3)]):
        many = np.repeat(places, len(u), axis=0)
        _, brought = probe(bench, light, SAMPLE, many, np.tile(u, (len(places), 1)), normal)
        assert brought.min() >= 0
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    many = np.repeat(places, len(directions), axis=0)
    each = np.tile(directions, (len(places), 1))
    assert probe(bench, light, DENSITY, many, each)[0].min() >= 0
    rays = np.concatenate([many, np.full((len(many), 1), FAR)], axis=1)
    assert probe(bench, light, SEEN, rays, each)[0].min() >= 0
    origin, direction = probe(bench, light, EMIT, np.repeat(u, 16, axis=0), np.tile(u, (16, 1)))
    assert np.abs(np.linalg.norm(direction[:, :3], axis=1) - 1).max() < 1e-6
    assert np.abs(origin[:, :3]).max() <= 2 * BOUNDS
