# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of one surface above each other, within a radius: photons and the coverage count the same.

Whatever is white under an even sky is as bright as the sky, however its parts hide each other.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import (
    BLACK,
    Instruction,
    Lobe,
    Material,
    Result,
    Scene,
    world_light,
)
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, orthographic, plain_material

SKY = (1.0, 0.5, 0.25)
WHITE = plain_material("white", (1.0, 1.0, 1.0))
SHELVES, PLATES = 5, 300
SIZE, PASSES, PHOTONS = 24, 32, 30000


def shelves() -> Any:
    """Boards of one mesh, each of two large triangles."""
    ends = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    vertices = [(x, y, 0.15 * layer) for layer in range(SHELVES) for x, y in ends]
    quads = np.arange(len(vertices)).reshape(-1, 4)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def heap(tilt: float, some_face_down: bool) -> Any:
    """Small plates of one mesh, anyhow."""
    rng = np.random.default_rng(4)
    middle = rng.uniform((-1, -1, 0), (1, 1, 0.8), (PLATES, 3))
    turn, lean = rng.uniform(0, 2 * np.pi, PLATES), rng.uniform(-tilt, tilt, PLATES)
    along = np.stack([np.cos(turn) * np.cos(lean), np.sin(turn) * np.cos(lean), np.sin(lean)], -1)
    across = np.stack([-np.sin(turn), np.cos(turn), np.zeros(PLATES)], -1)
    corners = middle[:, None] + 0.12 * np.stack([-along - across, along - across, 2 * across], 1)
    triangles = np.arange(3 * PLATES).reshape(PLATES, 3)
    if some_face_down:
        triangles[::2] = triangles[::2, ::-1]
    return corners.reshape(-1, 3), triangles


def stool(flipped: bool) -> Any:
    """A seat on a board, which it touches, and legs that end in it: one mesh of five bodies."""
    built = Builder().box((-1, -1, 0.5), (1, 1, 0.6)).box((-1, -1, 0.4), (1, 1, 0.5))
    for x, y in [(-0.5, -0.5), (0.2, -0.3), (0.0, 0.4)]:
        built.box((x, y, 0), (x + 0.3, y + 0.3, 0.55))
    triangles = np.concatenate(built.triangles)
    return np.concatenate(built.vertices), triangles[:, ::-1] if flipped else triangles


CASES = {
    "shelves": shelves(),
    "stool": stool(False),
    "turned stool": stool(True),
    "plates": heap(0.3, False),
    "leaves": heap(0.9, True),
}


def scene_of(name: str) -> Scene:
    """From above, before the sky, which lights it."""
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 1.2)
    return Builder().add(*CASES[name]).scene(view, [world_light("sky", SKY)], [WHITE])


def tiles() -> Scene:
    """White strips and mirrors in one plane, and of one mesh."""
    built = Builder()
    for strip in range(10):
        low, high = strip / 5 - 1, (strip + 1) / 5 - 1
        built.quad((low, -1, 0), (high, -1, 0), (high, 1, 0), (low, 1, 0), strip % 2)
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 1.2)
    mirror = Material("mirror", BLACK, (Lobe("mirror", (1.0, 1.0, 1.0)),))
    scene = built.scene(view, [world_light("sky", SKY)], [WHITE, mirror])
    return replace(scene, surface=np.zeros_like(scene.surface), surfaces=("tiles",))


@pytest.mark.parametrize("backend", ["native", "fragment"])
def test_photons_land_on_some_materials_alone(device: Device, backend: str) -> None:
    images = render(
        device,
        tiles(),
        width=SIZE,
        height=SIZE,
        passes=PASSES,
        photons=PHOTONS,
        radius=0.25,
        direct_by_photons=True,
        backend=backend,
    )
    np.testing.assert_allclose(images["Combined"][..., :3].mean(axis=(0, 1)), SKY, rtol=0.01)


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("holes", ["black", "open"])
@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
def test_white_dots_are_white(device: Device, backend: str, holes: str) -> None:
    """Between them a texture leaves nothing of the albedo, or what is behind is seen: photons land
    by the whole material, as the coverage of its triangles says."""
    program = (
        Instruction("geometry", ((0.0,) * 4, (0.0,) * 4)),
        Instruction("checker", (Result(0), (5.0,) * 4)),
        Instruction("arithmetic", ((1.0,) * 4, Result(1), (0.0,) * 4, (1.0,) * 4)),
    )
    lobes = (Lobe("transparent", (1.0, 1.0, 1.0), {}, varying={"weight": Result(2)}),)
    dots = Material(
        "dots",
        BLACK,
        lobes if holes == "open" else (),
        program=program,
        varying={"diffuse": Result(1)},
    )
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 1.2)
    scene = built.scene(view, [world_light("sky", SKY)], [dots])
    scene = replace(scene, objects=np.tile(np.eye(6, 4), (1, 1, 1)))
    settings: dict[str, Any] = {"backend": backend, "direct_by_photons": True}
    settings |= {"width": SIZE, "height": SIZE, "passes": 8, "photons": PHOTONS, "radius": 0.25}
    mean = render(device, scene, **settings)["Combined"][..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(mean, np.array(SKY) * (1.0 if holes == "open" else 0.5), rtol=0.015)


FLOOR = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
LAIN_ON = {
    "sheets": (FLOOR, False),
    "sheets on its back": (FLOOR[::-1], False),
    "boxes, sunk in": (FLOOR, True),
}


def lain_on(name: str) -> Scene:
    """A floor on which something lies, a twentieth of a percent of it high."""
    corners, are_boxes = LAIN_ON[name]
    built, high = Builder().quad(*corners), 1e-3
    for x, y in [(-0.7, -0.6), (0.1, -0.2), (-0.5, 0.3)]:
        if are_boxes:
            built.box((x, y, -high), (x + 0.3, y + 0.3, high))
        else:
            built.add([(x, y, high), (x + 0.4, y, high), (x, y + 0.5, high)], [(0, 1, 2)])
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 1.2)
    return built.scene(view, [world_light("sky", SKY)], [WHITE])


@pytest.mark.thorough("sheets on its back")
@pytest.mark.parametrize("name", LAIN_ON)
@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
def test_what_lies_on_a_floor_takes_no_light_off_it(
    device: Device, backend: str, name: str, thorough: bool
) -> None:
    """No photon lands below it, nor does that count."""
    if not (backend == "native" or (backend, name) == ("fragment", "sheets") or thorough):
        pytest.skip("runs with --thorough")
    settings: dict[str, Any] = {"backend": backend, "direct_by_photons": True}
    settings |= {"width": SIZE, "height": SIZE, "passes": PASSES}
    settings |= {"photons": 2 * PHOTONS, "radius": 0.25}
    shares = render(device, lain_on(name), **settings)["Combined"][..., :3] / np.array(SKY)
    np.testing.assert_allclose(shares.mean(axis=(0, 1)), 1.0, rtol=0.02)
    assert shares.min() > 0.85 and shares.max() < 1.2


@pytest.mark.thorough("0.25")
@pytest.mark.parametrize("radius", [0.04, 0.25])
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
def test_white_layers_under_an_even_sky(
    device: Device, backend: str, name: str, radius: float, thorough: bool
) -> None:
    if not (backend == "native" or thorough):
        pytest.skip("runs with --thorough")
    settings: dict[str, Any] = {"backend": backend, "direct_by_photons": True}
    images = render(
        device,
        scene_of(name),
        width=SIZE,
        height=SIZE,
        passes=PASSES,
        photons=PHOTONS,
        radius=radius,
        **settings,
    )
    np.testing.assert_allclose(images["Combined"][..., :3].mean(axis=(0, 1)), SKY, rtol=0.02)
