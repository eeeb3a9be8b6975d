# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds, images of the sky, many lights, emissive meshes and area lights where they fail."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.scene import BLACK, Image, Scene, area_light, sun_light, world_light
from addon.photon.settings import Settings
from addon.photon.stage.environments import solid_angles
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.physics.test_emission import RADIANCE, RECTANGLES, irradiance, under
from tests.physics.test_environment import lit
from tests.physics.test_world import ball, on_ball
from tests.scenes import DIM, Builder, orthographic, plain_light, plain_material
from tests.stability.table import Measured
from tests.stability.test_glossy import glossy

WHITE = (1.0, 1.0, 1.0)
GREY, ALBEDO = plain_material("grey", (0.5, 0.5, 0.5)), 0.5
PLATE = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
SIZE = 16


def plate(lights: Any, width: float = 1.0, eye: float = 0.01, **images: Any) -> Scene:
    """A grey square of two metres at height 0, seen from just above it."""
    view = orthographic((0, 0, eye), (1, 0, 0), (0, 1, 0), width)
    return replace(Builder().quad(*PLATE).scene(view, lights, [GREY]), **images)


def direct(device: Device, scene: Scene, passes: int) -> Any:
    """Radiance of direct light, (SIZE, SIZE, 3)."""
    return render(device, scene, width=SIZE, height=SIZE, passes=passes, photons=0)["Direct"]


def off(found: Any, expected: Any) -> float:
    """The largest relative difference of means over the picture."""
    means = [np.asarray(image, float).mean(axis=(0, 1)) for image in (found, expected)]
    return float(np.abs(means[0] / means[1] - 1.0).max())


@pytest.mark.stability(58)
def test_open_plane_under_a_world(device: Device, measured: Measured) -> None:
    found = direct(device, plate([world_light("sky", (1.0, 0.5, 0.25))]), 16)
    expected = np.broadcast_to(np.multiply((1.0, 0.5, 0.25), ALBEDO), found.shape)
    assert measured("open plane off", off(found, expected), "%") <= 0.005


@pytest.mark.stability(58)
@pytest.mark.thorough("ggx_metal")
@pytest.mark.parametrize("kind", ["ggx", "ggx_metal", "ggx_dielectric"])
def test_furnace_of_each_lobe(
    device: Device, measured: Measured, thorough: bool, kind: str
) -> None:
    """A white body shows a white world, whatever its roughness."""
    steps = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0) if thorough else (0.2, 0.6, 1.0)
    for roughness in steps:
        colour = (0.04,) * 3 if kind == "ggx_dielectric" else WHITE
        covered = WHITE if kind == "ggx_dielectric" else BLACK
        scene = ball(glossy(kind, roughness, colour, covered, tint=WHITE))
        scene = replace(scene, lights=(world_light("sky", WHITE),))
        passes = 256 if thorough else 64
        images = render(device, scene, width=24, height=24, passes=passes, photons=0)
        shown = on_ball(images["Combined"])
        assert measured("white lobe off", np.abs(shown - 1.0).max(), "%") <= 0.005, roughness


SKY, TIMES, ROWS = 1e-3, 1e6, 64  # radiance, of one texel so much more, of so many rows
ROW, COLUMN = 3 * ROWS // 4, ROWS // 2


def sky_with_a_texel() -> Image:
    pixels = np.full((ROWS, 2 * ROWS, 3), SKY, np.float32)
    pixels[ROW, COLUMN] *= TIMES
    return Image("sky", pixels)


def of_texel() -> tuple[float, Any]:
    """Irradiance across what the texel brings, and the direction that it goes; summed over its
    interpolation, which reaches to the middles of those around."""
    fine = np.linspace(-1, 1, 401)[:-1] + 1 / 400
    up = np.pi * ((ROW + 0.5 + fine[:, None]) / ROWS - 0.5)
    around = np.pi * (1 - (COLUMN + 0.5 + fine[None, :]) / ROWS)
    hat = (1 - abs(fine))[:, None] * (1 - abs(fine))[None, :]
    angle = (np.pi / ROWS / 200) ** 2 * np.cos(up) * hat
    towards = [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up) + 0 * around]
    total = np.array([(angle * axis).sum() for axis in towards]) * SKY * (TIMES - 1)
    size = float(np.linalg.norm(total))
    return size, -total / size


@pytest.mark.stability(59)
@pytest.mark.parametrize("by_photons", [False, True])
def test_a_texel_is_a_sun(device: Device, measured: Measured, by_photons: bool) -> None:
    """By the closed form, and as the sun of that solid angle where it stands."""
    power, direction = of_texel()
    whole = SKY * TIMES * float(solid_angles(ROWS, 2 * ROWS)[ROW])
    assert power == pytest.approx(whole, rel=0.01)  # of the solid angle of a texel
    view = orthographic((0, 0, 0.01), (1, 0, 0), (0, 1, 0), 1.0)
    scene = lit(Builder().quad(*PLATE), view, sky_with_a_texel(), GREY)
    if by_photons:  # on both of its sides
        falling = 4 * (2 * np.pi * SKY + abs(power * direction[2]))
        settings: dict[str, Any] = {"photons": 300_000, "radius": 0.2, "direct_by_photons": True}
        with rendered(device, scene, width=8, height=8, **settings) as renderer:
            error = np.abs(fallen(renderer)[0] / falling - 1.0).max()
    else:
        lights = [sun_light("sun", (power,) * 3, direction), world_light("sky", (SKY,) * 3)]
        error = off(direct(device, scene, 16), direct(device, plate(lights), 16))
    assert measured("texel off its sun", error, "%") <= 0.01


def bulbs(count: int) -> tuple[list[Any], Any]:
    """Of powers over six decades; half of them are below the plate, which is a wall to them. And
    where they are: (above, 4) places and powers."""
    rng = np.random.default_rng(5)
    at = np.column_stack([rng.uniform(-1, 1, (count, 2)), rng.uniform(0.2, 0.6, count)])
    at[count // 2 :, 2] *= -1.0
    power = 10 ** rng.uniform(-3, 3, count)
    made = [plain_light("b", "POINT", tuple(a), (p,) * 3) for a, p in zip(at, power, strict=True)]
    above = np.column_stack([at, power])[at[:, 2] > 0]
    return made, above


def under_bulbs(above: Any) -> Any:
    """Radiance of the plate, per pixel."""
    fine = 2 * SIZE
    x = ((np.arange(fine) + 0.5) / fine - 0.5) * 1.0
    total = np.zeros((fine, fine))
    for part in np.array_split(above, max(1, len(above) // 500)):
        dx, dy = x[None, :, None] - part[:, 0], x[:, None, None] - part[:, 1]
        total += (part[:, 3] * part[:, 2] / (dx**2 + dy**2 + part[:, 2] ** 2) ** 1.5).sum(axis=2)
    radiance = total / (4 * np.pi) * ALBEDO / np.pi
    return radiance.reshape(SIZE, 2, SIZE, 2).mean(axis=(1, 3))


@pytest.mark.stability(61)
def test_many_lights_of_all_powers(device: Device, measured: Measured, thorough: bool) -> None:
    """A pass takes less than half as much longer as there are more lights."""
    seconds = {}
    for count in (2, 100, 10_000, 100_000)[: 3 + thorough]:
        lights, above = bulbs(count)
        settings = Settings(width=SIZE, height=SIZE, photons=0, passes=64)
        renderer = prepare(plate(lights), settings, device)
        renderer.render_pass()
        start = time.process_time()
        for _ in range(31):
            renderer.render_pass()
        seconds[count] = (time.process_time() - start) / 31
        found = renderer.images()["Direct"][..., 0]
        renderer.release()
        error = abs(found.mean() / under_bulbs(above).mean() - 1.0)
        assert measured("mean off", error, "%") <= 0.01, count
    for few, many in zip(list(seconds)[1:], list(seconds)[2:], strict=False):
        times = seconds[many] / seconds[few]
        assert measured(f"pass of {many} lights over {few}'s", times) < 0.5 * many / few


def strips(count: int) -> tuple[Any, Any]:
    """The far rectangle as `count` triangles, and a hundredth as many without area among them."""
    (x0, y0, z), _, (x1, y1, _), _ = RECTANGLES["far"]
    x = np.linspace(x0, x1, count // 2 + 1)
    vertices = np.array([(a, b, z) for a in x for b in (y0, y1)])
    n = np.arange(count // 2)[:, None] * 2
    triangles = np.concatenate([n + np.array([0, 2, 1]), n + np.array([1, 2, 3])])
    flat = triangles[::100][:, [0, 0, 1]]
    return vertices, np.concatenate([triangles, flat])


@pytest.mark.stability(62)
@pytest.mark.parametrize("count", [1, 2, 100_000])
def test_emissive_meshes(device: Device, measured: Measured, thorough: bool, count: int) -> None:
    """One triangle, two, and slivers of two micrometres' width; by Lambert's formula."""
    corners = RECTANGLES["far"]
    if count == 1:
        corners = corners[:3]
    scene = under(RECTANGLES["far"])
    vertices, triangles = (np.array(corners, float), np.array([[0, 1, 2]]))
    if count > 1:
        vertices, triangles = strips(count)
    own = scene.surface == scene.surfaces.index("plate")
    first = len(scene.vertices)
    emissive = triangles + first
    normals = np.zeros((len(emissive), 3, 3), np.float32)
    scene = replace(
        scene,
        vertices=np.concatenate([scene.vertices, vertices]),
        triangles=np.concatenate([scene.triangles[own], emissive]).astype(np.int32),
        corner_normals=np.concatenate([scene.corner_normals[own], normals]),
        material=np.concatenate([scene.material[own], np.ones(len(emissive))]).astype(np.int32),
        surface=np.concatenate([scene.surface[own], np.ones(len(emissive))]).astype(np.int32),
    )
    found = direct(device, scene, 128 if thorough or count < 100 else 32)
    expected = irradiance(corners, 1.0)[..., None] * np.multiply(RADIANCE, ALBEDO / np.pi)
    assert measured("emissive mesh off", off(found, expected), "%") <= 0.005
    assert np.isfinite(found).all()


AREAS = {  # place, direction, across, size
    "edge-on": ((0, 0, 0.5), (1, 0, 0), (0, 1, 0), (0.6, 0.4)),
    "on a wall": ((-0.5, 0, 0.6), (1, 0, 0), (0, 1, 0), (0.6, 0.9)),
    "larger than the room": ((0, 0, 1.0), (0, 0, -1), (1, 0, 0), (4.0, 4.0)),
    "on the floor": ((0, 0, 1e-3), (0, 0, -1), (1, 0, 0), (1.0, 1.0)),
}


def corners_of_area(name: str) -> Any:
    place, direction, across, (wide, high) = AREAS[name]
    x, y = np.array(across, float) * wide / 2, np.cross(direction, across) * high / 2
    return [tuple(np.array(place) + a * x + b * y) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def lit_by_area(name: str) -> tuple[Scene, Any]:
    """A plate under one of AREAS, of radiance 1; and the irradiance of what is so wide of it."""
    place, direction, across, size = AREAS[name]
    power = np.pi * size[0] * size[1]
    light = area_light("lamp", place, (power,) * 3, direction, across, size=size)
    scene = plate([replace(light, found_by=("diffuse",))], eye=5e-4)
    if name == "on a wall":
        wall = Builder().quad(*PLATE).quad((-0.5, -1, 0), (-0.5, 1, 0), (-0.5, 1, 1), (-0.5, -1, 1))
        scene = wall.scene(scene.camera, list(scene.lights), [GREY])

    def expected(width: float) -> Any:
        found = irradiance(corners_of_area(name), width)
        x = ((np.arange(SIZE) + 0.5) / SIZE - 0.5) * width
        return np.where(x < place[0], 0.0, found) if direction[0] else found

    return scene, expected


@pytest.mark.stability(63)
@pytest.mark.parametrize("name", AREAS)
def test_area_lights(device: Device, measured: Measured, name: str) -> None:
    """Finite, and the closed form, by shadow rays; nothing where the light turns its back."""
    scene, expected = lit_by_area(name)
    found = direct(device, scene, 128)
    wanted = expected(1.0)[..., None] * np.full(3, ALBEDO / np.pi)
    assert np.isfinite(found).all() and not found[wanted == 0.0].any()
    assert measured("area light off", off(found, wanted), "%") <= 0.01


@pytest.mark.stability(63)
@pytest.mark.parametrize("name", AREAS)
def test_area_lights_by_photons(device: Device, measured: Measured, name: str) -> None:
    """All that falls on the plate."""
    scene, expected = lit_by_area(name)
    scene = replace(scene, materials=(DIM,))  # what it throws back falls somewhere, too
    settings: dict[str, Any] = {"photons": 400_000, "radius": 0.1, "direct_by_photons": True}
    with rendered(device, scene, width=8, height=8, **settings) as renderer:
        error = fallen(renderer)[0] / (4.0 * expected(2.0).mean()) - 1.0
    assert measured("area light by photons off", np.abs(error).max(), "%") <= 0.01
