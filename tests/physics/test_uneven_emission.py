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

from addon.photon.scene import BLACK, Instruction, Material, Result, Scene
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, orthographic, plain_material

GREY, ALBEDO = plain_material("grey", (0.5, 0.5, 0.5)), 0.5
SIZE, FINE = 16, 64  # pixels of a plate 1 m wide, and strips of an emissive rectangle's side
HEIGHT, SIDES = 0.4, (0.8, 0.5)  # of that, halves
NOWHERE = (0.0,) * 4
PRODUCT, SUM = (2.0,) * 4, (0.0,) * 4  # of arithmetic
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
    "angle": (
        (
            Instruction("fresnel", ((1.5,) * 4, NOWHERE, NOWHERE)),
            Instruction("arithmetic", (Result(0, "w"), (3.0,) * 4, NOWHERE, PRODUCT)),
        ),
        lambda x, cosine, is_front: 3.0 * cosine,
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
    program, radiance = PROGRAMS[name]
    varying = {"emission": Result(len(program) - 1)}
    return Material("emissive", BLACK, (), BLACK, program=program, varying=varying), radiance


@pytest.mark.parametrize("levels", [0, 2])
@pytest.mark.parametrize("is_front", [True, False], ids=["front", "back"])
@pytest.mark.parametrize("name", PROGRAMS)
def test_by_shadow_rays(device: Device, name: str, is_front: bool, levels: int) -> None:
    """In the mean and everywhere, of two large triangles and of 32 small ones."""
    material, radiance = emitter(name)
    scene = over(material, is_front, levels)
    images = render(device, scene, width=SIZE, height=SIZE, passes=64, photons=0)
    expected = irradiance(radiance, is_front, 1.0) * ALBEDO / np.pi
    found = images["Direct"][..., 0]
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)
    np.testing.assert_allclose(blocks(found), blocks(expected), rtol=0.03)


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
