# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive meshes light by closed forms: by shadow rays, by photons and by lobes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.lights import FOUND_BITS
from addon.photon.scene import BLACK, Instruction, Lobe, Material, Result, Scene, point_light
from addon.photon.stage import emissive
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, orthographic, plain_material

RADIANCE = (4.0, 2.0, 1.0)
WHITE = (1.0, 1.0, 1.0)
GREY, ALBEDO = plain_material("grey", (0.5, 0.5, 0.5)), 0.5
EMISSIVE = Material("emissive", BLACK, (), RADIANCE)
SIZE, FINE = 16, 4  # pixels, and points a pixel's width
# Above a plate [-1, 1]^2 at z = 0: at a distance, so close that it is all around, and a wall on it.
RECTANGLES = {
    "far": [(-1, -0.5, 0.5), (1, -0.5, 0.5), (1, 0.5, 0.5), (-1, 0.5, 0.5)],
    "near": [(-1, -0.8, 0.01), (1, -0.8, 0.01), (1, 0.8, 0.01), (-1, 0.8, 0.01)],
    "wall": [(-1, 0.6, 0), (1, 0.6, 0), (1, 0.6, 1), (-1, 0.6, 1)],
    "grazing": [(-1, 0.6, 0.1), (1, 0.6, 0.1), (1, 1.2, 0.1), (-1, 1.2, 0.1)],
}


def irradiance(corners: Any, width: float) -> NDArray[Any]:
    """Of a polygon of radiance 1 on the plate, per pixel of a square about its middle (Lambert's
    formula)."""
    x = ((np.arange(SIZE * FINE) + 0.5) / (SIZE * FINE) - 0.5) * width
    places = np.stack([*np.meshgrid(x, x), np.zeros((len(x), len(x)))], -1)
    to = np.array(corners, float) - places[:, :, None]
    to /= np.linalg.norm(to, axis=-1, keepdims=True)
    after = np.roll(to, -1, axis=2)
    across = np.cross(to, after)
    sine = np.linalg.norm(across, axis=-1)
    angle = np.arctan2(sine, (to * after).sum(-1))
    each = np.divide(angle * across[..., 2], sine, out=np.zeros_like(sine), where=sine > 0)
    total: NDArray[Any] = np.abs(each.sum(-1)) / 2
    return total.reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))


def under(corners: Any, flipped: bool = False, width: float = 1.0) -> Scene:
    """The plate, seen from between it and an emissive rectangle."""
    corners = corners[::-1] if flipped else corners
    eye = max(min(z for *_, z in corners) / 2, 1e-3)
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0, "plate")
    view = orthographic((0, 0, eye), (1, 0, 0), (0, 1, 0), width)
    return built.quad(*corners, 1, "emissive").scene(view, [], [GREY, EMISSIVE])


@pytest.mark.thorough("wall-", "grazing-other")
@pytest.mark.parametrize("flipped", [False, True], ids=["one side", "other side"])
@pytest.mark.parametrize("name", RECTANGLES)
def test_a_rectangle_by_shadow_rays(device: Device, name: str, flipped: bool) -> None:
    corners = RECTANGLES[name]
    scene = under(corners, flipped)
    images = render(device, scene, width=SIZE, height=SIZE, passes=256, photons=0)
    expected = irradiance(corners, 1.0)[..., None] * np.multiply(RADIANCE, ALBEDO / np.pi)
    found = images["Direct"][..., :3]
    np.testing.assert_allclose(found.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=5e-3)
    np.testing.assert_allclose(found, expected, rtol=0.15)  # nowhere is much missing


@pytest.mark.parametrize("flipped", [False, True], ids=["one side", "other side"])
def test_a_rectangle_by_photons(device: Device, flipped: bool) -> None:
    corners = RECTANGLES["far"]
    settings: dict[str, Any] = {"photons": 1_000_000, "radius": 0.2, "direct_by_photons": True}
    with rendered(device, under(corners, flipped), width=8, height=8, **settings) as renderer:
        expected = np.multiply(RADIANCE, 4.0 * irradiance(corners, 2.0).mean())
        np.testing.assert_allclose(fallen(renderer)[0], expected, rtol=5e-3)


def test_a_sphere(device: Device) -> None:
    """E = pi L (r / d)^2 below a sphere, by shadow rays to each of its triangles."""
    radius, height = 0.2, 1.0
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    built.sphere((0, 0, height), radius, 1, subdivisions=1)
    scene = built.scene(orthographic((0, 0, 0.5), (1, 0, 0), (0, 1, 0), 0.1), [], [GREY, EMISSIVE])
    images = render(device, scene, width=SIZE, height=SIZE, passes=64, photons=0)
    found = images["Direct"][..., :3].mean(axis=(0, 1))
    # An icosphere of 80 triangles: its mean silhouette is a quarter of its surface.
    corners = scene.vertices[scene.triangles[2:]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    share = np.linalg.norm(across, axis=1).sum() / 2 / (4 * np.pi * radius**2)
    expected = np.multiply(RADIANCE, ALBEDO * (radius / height) ** 2) * share
    np.testing.assert_allclose(found, expected, rtol=0.03)
    assert images["Emission"].max() == 0.0


def in_an_emissive_ball(lobe: Lobe) -> Scene:
    """A white body that is lit from everywhere by a mesh."""
    view = orthographic((0, 0, 1.5), (1, 0, 0), (0, 1, 0), 0.8)
    built = Builder().sphere((0, 0, 0), 1.0, subdivisions=4)
    built.sphere((0, 0, 0), 2.0, 1, subdivisions=0, smooth=False)
    return built.scene(view, [], [Material("white", BLACK, (lobe,)), EMISSIVE])


@pytest.mark.thorough("shadow rays-1.0", "both-0.36")
@pytest.mark.parametrize("alpha", [0.0, 0.01, 0.36, 1.0])
@pytest.mark.parametrize("found_by", ["both", "lobes", "shadow rays"])
def test_white_furnace(
    device: Device, monkeypatch: pytest.MonkeyPatch, alpha: float, found_by: str
) -> None:
    """What absorbs nothing shows what is about it: by rays of lobes, by shadow rays, and by both,
    each in its share."""
    parameters = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0}
    lobe = Lobe("ggx", WHITE, parameters) if alpha else Lobe("mirror", WHITE)
    if found_by == "shadow rays" and alpha < 0.3:
        pytest.skip("a sharp lobe by shadow rays to all around is noise")
    bits = {"lobes": ("chains",), "shadow rays": ("glossy",), "both": ("glossy", "chains")}
    monkeypatch.setattr(emissive, "EVERYONE", sum(FOUND_BITS[name] for name in bits[found_by]))
    scene, settings = in_an_emissive_ball(lobe), {"width": 24, "height": 24, "photons": 0}
    depth = 0 if found_by == "shadow rays" else 4
    images = render(device, scene, **settings, passes=80, mirror_depth=depth)
    found = images["Combined"][6:18, 6:18, :3].mean(axis=(0, 1))
    np.testing.assert_allclose(found, RADIANCE, rtol=8e-3)


def test_what_emits_is_seen(device: Device) -> None:
    """On both sides, whatever lamps there are, and it reflects besides."""
    for side in (1.0, -1.0):
        view = orthographic((0, 0, side), (side, 0, 0), (0, 1, 0), 1.0)
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
        material = replace(GREY, emission=RADIANCE)
        lamp = point_light("lamp", (0.0, 0.0, 50.0 * side), (1e4,) * 3)
        images = render(device, built.scene(view, [lamp], [material]), photons=0)
        np.testing.assert_allclose(images["Emission"][..., :3] / RADIANCE, 1.0, rtol=1e-6)
        reflected = 1e4 / (4 * np.pi * 50.0**2) * ALBEDO / np.pi
        np.testing.assert_allclose(images["Direct"][..., :3], reflected, rtol=1e-3)


def test_a_program_emits_as_a_constant_does(device: Device) -> None:
    """Seen, by shadow rays and by photons; it lights as much as it radiates in the mean."""
    program = (
        Instruction("combine", tuple((x, x, x, 1.0) for x in (*RADIANCE, 1.0))),
        Instruction("geometry", ((0.0,) * 4, (0.0,) * 4)),  # a position, x from -1 to 1
        Instruction("arithmetic", (Result(1, "x"), Result(0), Result(0), (4.0,) * 4)),
    )
    images = []
    for result in (None, Result(0), Result(2)):
        varying = {"emission": result} if result else {}
        emission = BLACK if result else RADIANCE
        emitter = Material("emissive", BLACK, (), emission, program=program, varying=varying)
        scene = replace(under(RECTANGLES["far"]), materials=(GREY, emitter))
        scene = replace(scene, objects=np.tile(np.eye(6, 4), (2, 1, 1)))
        images.append(render(device, scene, width=SIZE, height=SIZE, passes=16, photons=4096))
    for name in ("Combined", "Direct", "Indirect"):
        np.testing.assert_allclose(images[1][name], images[0][name], rtol=1e-5, atol=1e-7)
    constant, gradient = (image["Direct"][..., :3].mean(axis=(0, 1)) for image in images[::2])
    np.testing.assert_allclose(gradient, constant, rtol=0.03)
    # Looked at from below: radiance (1 + x) times as much.
    view = orthographic((0, 0, 0.1), (1, 0, 0), (0, -1, 0), 1.0)
    seen = render(device, replace(scene, camera=view), width=SIZE, height=SIZE, passes=8, photons=0)
    x = (np.arange(SIZE) + 0.5) / SIZE - 0.5
    np.testing.assert_allclose(
        seen["Combined"][SIZE // 2, :, 0], RADIANCE[0] * (1.0 + x), rtol=0.02
    )


@pytest.mark.parametrize(("asker", "is_seen", "lights"), [(0.0, 1.0, 0.0), (2.0, 0.0, 1.0)])
def test_what_emits_by_who_asks(
    device: Device, asker: float, is_seen: float, lights: float
) -> None:
    """Light Path's Is Camera Ray is seen and lights nothing, Is Diffuse Ray is not seen and
    lights, by shadow rays and by photons."""
    program = (Instruction("light_path", ((asker,) * 4,)),)
    images = []
    for varying, emission in (({}, WHITE), ({"emission": Result(0)}, BLACK)):
        emitter = Material("emissive", BLACK, (), emission, program=program, varying=varying)
        scene = replace(under(RECTANGLES["far"]), materials=(GREY, emitter))
        scene = replace(scene, objects=np.tile(np.eye(6, 4), (2, 1, 1)))
        images.append(render(device, scene, width=SIZE, height=SIZE, passes=2, photons=1024))
    for name in ("Direct", "Indirect"):
        np.testing.assert_allclose(images[1][name], lights * images[0][name], rtol=1e-5, atol=1e-7)
    view = orthographic((0, 0, 0.1), (1, 0, 0), (0, -1, 0), 0.5)
    seen = render(device, replace(scene, camera=view), width=4, height=4, passes=2, photons=0)
    np.testing.assert_allclose(seen["Emission"][..., :3], is_seen, atol=1e-6)
