# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive meshes whose programs differ from place to place, by side or by direction light by sums
over their surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import (
    BLACK,
    Image,
    Instruction,
    Material,
    Moving,
    Result,
    Scene,
    point_light,
)
from addon.photon.stage.emission import Grid
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, orthographic, plain_material

GREY, ALBEDO = plain_material("grey", (0.5, 0.5, 0.5)), 0.5
SIZE, FINE = 16, 64  # pixels of a plate 1 m wide, and strips of an emissive rectangle's side
HEIGHT, SIDES = 0.4, (0.8, 0.5)  # of that, halves
NOWHERE = (0.0,) * 4
PRODUCT, IS_GREATER = (2.0,) * 4, (10.0,) * 4  # of arithmetic
Radiance = Callable[[NDArray[Any], NDArray[Any], bool], NDArray[Any]]


def place() -> Instruction:
    """x from -1 to 1 in the object's space, which is the world's."""
    return Instruction("geometry", (NOWHERE, NOWHERE))


PROGRAMS: dict[str, tuple[tuple[Instruction, ...], Radiance]] = {
    "gradient": (
        (
            place(),
            Instruction("arithmetic", (Result(0, "x"), (1.0,) * 4, NOWHERE, (0.0,) * 4)),
        ),
        lambda x, cosine, is_front: 1.0 + x,
    ),
    "one side": (
        (
            Instruction("geometry", ((6.0,) * 4, NOWHERE)),
            Instruction("arithmetic", (Result(0), (-2.0,) * 4, (2.0,) * 4, (4.0,) * 4)),
        ),
        lambda x, cosine, is_front: np.full_like(x, 2.0 if is_front else 0.0),
    ),
    "steep": (
        (
            Instruction("fresnel", ((1.5,) * 4, NOWHERE, NOWHERE)),
            *(
                Instruction("arithmetic", (of_last, of_last, NOWHERE, PRODUCT))
                for of_last in (Result(0, "w"), Result(1), Result(2))
            ),
        ),
        lambda x, cosine, is_front: cosine**8,
    ),
    "angle": (
        (
            Instruction("fresnel", ((1.5,) * 4, NOWHERE, NOWHERE)),
            Instruction("arithmetic", (Result(0, "w"), (3.0,) * 4, NOWHERE, PRODUCT)),
        ),
        lambda x, cosine, is_front: 3.0 * cosine,
    ),
}

# Of many triangles few are lit.
STRIP: dict[str, tuple[tuple[Instruction, ...], Radiance]] = {
    "angle of a strip": (
        (
            Instruction("fresnel", ((1.5,) * 4, NOWHERE, NOWHERE)),
            place(),
            Instruction("arithmetic", (Result(1, "x"), (0.7,) * 4, NOWHERE, IS_GREATER)),
            Instruction("arithmetic", (Result(0, "w"), Result(2), NOWHERE, PRODUCT)),
        ),
        lambda x, cosine, is_front: cosine * (x > 0.7),
    ),
}


def over(emitter: Material, is_front: bool, levels: int) -> Scene:
    """A plate, seen from between it and an emissive rectangle of 2 x 4^levels triangles, of which
    it sees the front or the back."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0, "plate")
    x, y = (np.linspace(-side, side, 2**levels + 1) for side in SIDES)
    for (low, high), (near, far) in product(pairwise(x), pairwise(y)):
        around = ((low, near), (low, far), (high, far), (high, near))
        corners = [(a, b, HEIGHT) for a, b in around]
        built.quad(*(corners if is_front else corners[::-1]), 1, "emissive")
    view = orthographic((0, 0, HEIGHT / 2), (1, 0, 0), (0, 1, 0), 1.0)
    scene = built.scene(view, [], [GREY, emitter])
    return replace(scene, objects=np.tile(np.eye(6, 4), (int(scene.surface.max()) + 1, 1, 1)))


def irradiance(radiance: Radiance, is_front: bool, width: float) -> NDArray[Any]:
    """Per pixel of a square about the plate's middle."""
    at = ((np.arange(SIZE) + 0.5) / SIZE - 0.5) * width
    strips = [((np.arange(FINE) + 0.5) / FINE * 2 - 1) * side for side in SIDES]
    x, y = np.meshgrid(*strips)
    away = [
        plate[..., None, None] - light
        for plate, light in zip(np.meshgrid(at, at), (x, y), strict=True)
    ]
    squared = away[0] ** 2 + away[1] ** 2 + HEIGHT**2
    cosine = HEIGHT / np.sqrt(squared)
    area = 4 * SIDES[0] * SIDES[1] / FINE**2
    each = radiance(np.broadcast_to(x, cosine.shape), cosine, is_front) * cosine**2 / squared
    total: NDArray[Any] = each.sum(axis=(2, 3)) * area
    return total


def emitter(name: str) -> tuple[Material, Radiance]:
    program, radiance = {**PROGRAMS, **STRIP}[name]
    varying = {"emission": Result(len(program) - 1)}
    return Material("emissive", BLACK, (), BLACK, program=program, varying=varying), radiance


@pytest.mark.thorough("2-back", "4-back")
@pytest.mark.parametrize("is_front", [True, False], ids=["front", "back"])
@pytest.mark.parametrize(
    ("name", "levels"), [*product(PROGRAMS, (0, 2)), *product(("angle", *STRIP), (4,))]
)
def test_by_shadow_rays(device: Device, name: str, is_front: bool, levels: int) -> None:
    """In the mean and everywhere, of two large triangles, of 32, and of 512 that are drawn."""
    material, radiance = emitter(name)
    scene = over(material, is_front, levels)
    images = render(device, scene, width=SIZE, height=SIZE, passes=64, photons=0)
    expected = irradiance(radiance, is_front, 1.0) * ALBEDO / np.pi
    found = images["Direct"][..., 0]
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)
    np.testing.assert_allclose(blocks(found), blocks(expected), rtol=0.04)


@pytest.mark.thorough("gradient-back", "steep-back", "angle-back")
@pytest.mark.parametrize("is_front", [True, False], ids=["front", "back"])
@pytest.mark.parametrize("name", PROGRAMS)
def test_by_photons(device: Device, name: str, is_front: bool) -> None:
    material, radiance = emitter(name)
    settings: dict[str, Any] = {"photons": 200_000, "radius": 0.2, "direct_by_photons": True}
    with rendered(device, over(material, is_front, 0), width=8, height=8, **settings) as renderer:
        found = fallen(renderer)[0] if renderer.photons else np.zeros(3)
    expected = 4.0 * irradiance(radiance, is_front, 2.0).mean()
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-9)


def blocks(image: NDArray[Any]) -> NDArray[Any]:
    """Means of 4x4 pixels."""
    means: NDArray[Any] = image.reshape(SIZE // 4, 4, SIZE // 4, 4).mean(axis=(1, 3))
    return means


@pytest.mark.parametrize("name", ["one side", "angle"])
def test_of_what_moves(device: Device, name: str) -> None:
    """What moves but stays where it is lights as what stands still; it is asked for each pass."""
    material, _ = emitter(name)
    still = over(material, True, 2)
    count = len(still.vertices)
    nowhere = np.zeros((3, count - 4, 3), np.float32)
    moves = Moving((4, count), offsets=nowhere, normals=np.zeros((3, 0, 3), np.float32))
    size: dict[str, Any] = {"width": SIZE, "height": SIZE, "passes": 16, "photons": 2000}
    pictures = [
        blocks(render(device, scene, **size)["Direct"][..., 0])
        for scene in (still, replace(still, moving=(moves,)))
    ]
    np.testing.assert_allclose(*pictures, rtol=0.02)


@pytest.mark.parametrize("triangles", [1, 100, 1000, 10000])
def test_points_of_cells_are_even(triangles: int) -> None:
    """In the mean they are a triangle's middle, so what goes up steadily has its mean there."""
    grid = Grid.of(triangles, 1 << 17)
    middle = np.einsum("csk,c->k", grid.points, grid.weights) / grid.points.shape[1]
    np.testing.assert_allclose(middle, 1.0 / 3.0, rtol=1e-12)
    assert grid.weights.sum() == pytest.approx(1.0) and (grid.points.sum(axis=2) < 1.0).all()


def test_beside_a_lamp_with_an_image(device: Device) -> None:
    """Each has its own."""
    colours = np.tile(np.linspace(0.0, 2.0, 64)[None, :, None], (32, 1, 3)).astype(np.float32)
    lamp = replace(point_light("lamp", (0.1, 0.1, 0.3), (1.0,) * 3), gobo=0)
    lit = over(emitter("gradient")[0], True, 0)
    both = replace(lit, lights=(lamp,), images=(Image("colours", colours),))
    dark = Material("emissive", BLACK)
    alone = replace(both, materials=(GREY, dark))
    size: dict[str, Any] = {"width": SIZE, "height": SIZE, "passes": 64, "photons": 0}
    found, by_panel, by_lamp = (
        blocks(render(device, scene, **size)["Direct"][..., 0]) for scene in (both, lit, alone)
    )
    assert by_lamp.max() > 2.0 * by_lamp.min() > 0.0
    np.testing.assert_allclose(found, by_panel + by_lamp, rtol=0.02)
