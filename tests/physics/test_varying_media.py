# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that differ from place to place, by closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import BLACK, Instruction, Material, Medium, Result, point_light, sun_light
from addon.photon.scene.checks import RGB
from addon.photon.scene.programs import Constant
from addon.photon.scene.values import world_light
from addon.streams import Device
from tests.measure import fallen, rendered
from tests.physics.test_media import (
    BACKENDS,
    EMISSIVE,
    ENDLESS,
    WALL,
    WHITE,
    everywhere,
    from_above,
    henyey_greenstein,
    holding,
    in_box,
    mean_of,
)
from tests.scenes import Builder, plain_material

UP: Constant = (0.0, 0.0, 1.0, 0.0)
ASIDE: Constant = (1.0, 0.0, 0.0, 1.0)  # 1 + x


def along(row: Constant, *, absorbs: RGB = BLACK, scatters: RGB = BLACK, g: float = 0.0) -> Medium:
    """So much [1/m], times what a row makes of a place [m]."""
    program = [Instruction("geometry", ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)))]
    results = []
    for colour in (absorbs, scatters):
        rows = [tuple(factor * x for x in row) for factor in colour]
        program.append(Instruction("matrix", (Result(0), *rows)))  # type: ignore[arg-type]
        results.append(Result(len(program) - 1))
    absorbed, scattered = (
        result if any(colour) else BLACK
        for result, colour in zip(results, (absorbs, scatters), strict=True)
    )
    return Medium(absorbed, scattered, g, program=tuple(program))


def test_slab_that_scatters_once(device: Device) -> None:
    """Denser further up: scattering p E integral of x exp(-extinction (d^2 - x^2) (1 + 1 / cos) /
    2)."""
    cosine, deep, scatters, absorbs = (
        math.cos(math.radians(40)),
        1.2,
        (1.0, 0.5, 2.0),
        (0.2, 0.5, 0),
    )
    sun = sun_light("sun", WHITE, (math.sin(math.radians(40)), 0.0, -cosine))
    expected = []
    for s, a in zip(scatters, absorbs, strict=True):
        lost = (s + a) * (1.0 + 1.0 / cosine)
        brought = (1.0 - math.exp(-lost * deep**2 / 2)) / lost
        expected.append(s * henyey_greenstein(0.4, -cosine) * brought)
    medium = along(UP, absorbs=absorbs, scatters=scatters, g=0.4)
    scene = (
        Builder()
        .box((-40, -40, 0), (40, 40, deep), 0)
        .scene(from_above(), (sun,), (holding(medium),))
    )
    for backend in BACKENDS:
        found = mean_of(device, scene, backend=backend, passes=64)
        assert found == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("where", (in_box, everywhere))
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_seen_and_lit_through_it(
    device: Device, backend: str, where: Callable[..., dict[str, Any]]
) -> None:
    """Of what a surface emits, and of a lamp's light to a plate below and on to the camera."""
    colour = (0.02, 0.05, 0.1)
    medium = along((0.0, 0.0, 1.0, 1.0), absorbs=colour)  # by how far it is above -1
    depth = 3.0 + 3.0**2 / 2

    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), 0)
    built.quad((-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1), 0)  # not seen
    more = where(built, medium)
    seen = mean_of(device, built.scene(from_above(height=3.0), (), **more), backend=backend)
    assert seen == pytest.approx(np.exp(-depth * np.array(colour)), rel=2e-3)

    more["materials"] = (plain_material("grey", (0.5,) * 3), *more["materials"][1:])
    lamp = point_light("lamp", (0.0, 0.0, 2.0), (4.0 * math.pi,) * 3, 0.0)
    lit = mean_of(device, built.scene(from_above(0.02, 3.0), (lamp,), **more), backend=backend)
    depth += 2.0 + 2.0**2 / 2
    assert lit == pytest.approx(0.125 / math.pi * np.exp(-depth * np.array(colour)), rel=3e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_nothing_is_lost_in_white_fog(device: Device, backend: str) -> None:
    """Where nothing is absorbed, a ball in a world of one radiance can't be seen."""
    white = along(ASIDE, scatters=(3.0, 1.0, 5.0), g=0.3)
    scene = (
        Builder()
        .sphere((0, 0, 0), 1.0, 0)
        .scene(from_above(2.4), (world_light("World", WHITE),), (holding(white),))
    )
    found = mean_of(device, scene, backend=backend, passes=48, **ENDLESS)
    assert found == pytest.approx(1.0, rel=0.015)


@pytest.mark.parametrize("backend", BACKENDS)
def test_photons_in_what_absorbs(device: Device, backend: str) -> None:
    """From a lamp in it to the walls of a ball about that: in the mean exp(-k) sinh(k / 2) /
    (k / 2) of its flux."""
    colour = np.array((0.3, 1.0, 2.0))
    lamp = point_light("lamp", (0.0, 0.0, 0.0), WHITE)
    built = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=5)
    air = along(ASIDE, absorbs=(0.3, 1.0, 2.0))
    scene = built.scene(from_above(0.5, 0.9), (lamp,), (WALL,), air=air)
    settings = {"photons": 1 << 16, "width": 8, "height": 8, "backend": backend}
    with rendered(device, scene, direct_by_photons=True, **settings) as renderer:
        found = fallen(renderer).sum(axis=0)
    expected = np.exp(-colour) * np.sinh(colour / 2) / (colour / 2)
    assert found == pytest.approx(expected, rel=0.006)


def test_fog_that_ends_above(device: Device) -> None:
    """What is everywhere goes on beside all that is there, and lets the world through where there
    is none of it."""
    lost = 0.6
    air = along((0.0, 0.0, -lost, lost), absorbs=WHITE)  # none from 1 m on
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
    scene = built.scene(from_above(0.5, 1.0), (), (EMISSIVE,), air=air)
    assert mean_of(device, scene) == pytest.approx(math.exp(-lost / 2), rel=2e-3)
    world = world_light("World", WHITE)
    wall = replace(plain_material("grey", (0.5,) * 3))
    lit = mean_of(device, replace(scene, lights=(world,), materials=(wall,)), passes=64)
    cosine: NDArray[np.float64] = (np.arange(1000) + 0.5) / 1000
    around = 2.0 * (cosine * np.exp(-lost / 2 / cosine)).mean()
    assert lit == pytest.approx(0.5 * around * math.exp(-lost / 2), rel=0.01)


NONE: Constant = (0.0, 0.0, 0.0, 0.0)


def numbered(number: int) -> Constant:
    """Of an operation."""
    return (float(number), 0.0, 0.0, 0.0)


def falling(dense: float, height: float) -> Medium:
    """It absorbs `dense` exp(-z / height) [1/m]."""
    program = (
        Instruction("geometry", (NONE, NONE)),
        Instruction("matrix", (Result(0), *[(0.0, 0.0, -1.0 / height, 0.0)] * 3)),
        Instruction("functions", (Result(1), NONE, numbered(4))),
        Instruction("arithmetic", (Result(2), (dense,) * 4, NONE, numbered(2))),
    )
    return Medium(Result(3), BLACK, program=program)


def peaked(most: float, middle: float, half: float) -> Medium:
    """It absorbs `most` [1/m] at a height, and evenly less to none so far from there [m]."""
    program = (
        Instruction("geometry", (NONE, NONE)),
        Instruction("matrix", (Result(0), *[(0.0, 0.0, 1.0 / half, -middle / half)] * 3)),
        Instruction("arithmetic", (Result(1), NONE, NONE, numbered(6))),
        Instruction("arithmetic", ((1.0,) * 4, Result(2), NONE, numbered(1))),
        Instruction("arithmetic", (Result(3), NONE, NONE, numbered(8))),
        Instruction("arithmetic", (Result(4), (most,) * 4, NONE, numbered(2))),
    )
    return Medium(Result(5), BLACK, program=program)


def floor(half: float = 9.0, height: float = 0.0) -> list[tuple[float, float, float]]:
    """The corners of a square."""
    return [(x * half, y * half, height) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def test_fog_that_never_ends(device: Device) -> None:
    """Of a world through what falls off above all that is there, and goes on beside it."""
    height = 0.3
    built = Builder().quad(*floor(3.0), 0)
    grey, world = plain_material("grey", (0.5,) * 3), world_light("World", WHITE)
    scene = built.scene(from_above(0.5, 1.0), (world,), (grey,), air=falling(1.0, height))
    cosine: NDArray[np.float64] = (np.arange(1000) + 0.5) / 1000
    around = 2.0 * (cosine * np.exp(-height / cosine)).mean()
    seen = math.exp(-height * (1.0 - math.exp(-1.0 / height)))
    assert mean_of(device, scene, passes=64) == pytest.approx(0.5 * around * seen, rel=0.015)


@pytest.mark.parametrize("far", (20.0, 400.0))
def test_small_things_in_what_is_everywhere(device: Device, far: float) -> None:
    """However large that is, steps are short where a thing differs."""
    built = Builder().quad(*floor(), 0).box((-0.8, -0.8, 0.01), (0.8, 0.8, 1.0), 1)
    built.quad(*floor(far, -1.0), 0)
    air = along((0.0, 0.0, 1e-7, 1e-5), absorbs=WHITE)
    materials = EMISSIVE, holding(peaked(10.0, 0.5, 0.1))
    scene = built.scene(from_above(0.3, 3.0), (), materials, air=air)
    assert mean_of(device, scene, passes=4) == pytest.approx(math.exp(-1.0), rel=0.01)


@pytest.mark.parametrize("half", (1.0, 100.0))
def test_flat_boxes(device: Device, half: float) -> None:
    """However wide they are, there are many places between top and bottom."""
    height, dense = 0.4, 3.0
    built = Builder().quad(*floor(200.0), 0).box((-half, -half, 0.001), (half, half, 2.0), 1)
    materials = EMISSIVE, holding(falling(dense, height))
    found = mean_of(device, built.scene(from_above(0.5, 3.0), (), materials), passes=4)
    depth = dense * height * (math.exp(-0.001 / height) - math.exp(-2.0 / height))
    assert found == pytest.approx(math.exp(-depth), rel=0.005)


def test_a_thing_in_two_that_differ(device: Device) -> None:
    """Both count where they overlap."""
    built = Builder().quad(*floor(), 0).box((-5, -5, 0.5), (5, 5, 2.0), 1)
    built.box((-4, -4, 1.0), (4, 4, 2.5), 2)
    first, second = along(UP, absorbs=(0.1, 0.2, 0.3)), along(UP, absorbs=(0.3, 0.2, 0.0))
    materials = EMISSIVE, holding(first), holding(second)
    found = mean_of(device, built.scene(from_above(0.5, 3.0), (), materials), passes=4)
    depths = (2.0**2 - 0.5**2) / 2, (2.5**2 - 1.0**2) / 2
    colours = np.array(((0.1, 0.2, 0.3), (0.3, 0.2, 0.0)))
    assert found == pytest.approx(np.exp(-np.array(depths) @ colours), rel=2e-3)


def test_surfaces_of_one_thing_that_overlap(device: Device) -> None:
    """Light is lost in it once, and as in Cycles no more behind the first of its backs."""
    built = Builder().quad(*floor(), 0)
    thing = Builder().box((-5, -5, 0.5), (5, 5, 2.0), 1).box((-5, -5, 1.0), (5, 5, 2.5), 1)
    scene = built.scene(from_above(0.5, 3.0), (), (EMISSIVE, holding(Medium((0.2,) * 3))))
    own = thing.scene(from_above(), (), (EMISSIVE, EMISSIVE))
    scene = replace(
        scene,
        vertices=np.concatenate([scene.vertices, own.vertices]),
        triangles=np.concatenate([scene.triangles, own.triangles + len(scene.vertices)]),
        corner_normals=np.concatenate([scene.corner_normals, own.corner_normals]),
        material=np.concatenate([scene.material, np.ones_like(own.material)]),
        surface=np.concatenate([scene.surface, np.ones_like(own.surface)]),
        surfaces=(*scene.surfaces[:1], "thing"),
    )
    found = mean_of(device, scene, passes=4)
    assert found == pytest.approx(math.exp(-0.2 * 1.5), rel=1e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_back_of_an_open_mesh(device: Device, backend: str) -> None:
    """Nobody who sees it is inside: as in Cycles neither eye nor lamp loses light before it."""
    wall = Material("wall", (0.5,) * 3, medium=Medium((0.9,) * 3))
    built = Builder().quad((-5, -5, 0), (-5, 5, 0), (5, 5, 0), (5, -5, 0), 0)  # faces down
    lamp = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
    scene = built.scene(from_above(2.0, 1.0), (lamp,), (wall,))
    found = mean_of(device, scene, passes=1, backend=backend)
    assert found == pytest.approx(0.5 / math.pi, rel=1e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_photons_that_start_beside_all(device: Device, backend: str) -> None:
    """Of a low sun, through fog beside the box about all, too."""
    cosine, depth = math.cos(math.radians(70)), 0.4
    sun = sun_light("sun", WHITE, (math.sin(math.radians(70)), 0.0, -cosine))
    built = Builder().quad(*floor(1.0), 0)
    air = falling(depth / 0.05, 0.05)
    scene = built.scene(from_above(1.0, 0.3), (sun,), (WALL,), air=air)
    settings = {"photons": 1 << 16, "width": 8, "height": 8, "backend": backend}
    with rendered(device, scene, direct_by_photons=True, **settings) as renderer:
        found = fallen(renderer).sum(axis=0) / 4.0
    assert found == pytest.approx(cosine * math.exp(-depth / cosine), rel=0.05)


@pytest.mark.parametrize("backend", BACKENDS)
def test_alpha_through_fog_that_ends(device: Device, backend: str) -> None:
    """What it takes of nothing is opaque."""
    air = along((0.0, 0.0, 0.2, 0.1), absorbs=(0.5,) * 3, scatters=(0.5,) * 3)  # from -0.5 m on
    scene = Builder().quad(*floor(0.1, -0.5), 0).scene(from_above(2.0, 1.0), (), (WALL,), air=air)
    settings = {"width": 8, "height": 8, "passes": 64, "photons": 0, "backend": backend}
    with rendered(device, scene, transparent=True, **settings) as renderer:
        alpha = renderer.images()["Combined"][0, :, 3].mean()
    assert alpha == pytest.approx(1.0 - math.exp(-(0.2 * 1.5**2) / 2), abs=0.01)
