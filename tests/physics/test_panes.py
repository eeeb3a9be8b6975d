# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from afar through panes: by shadow rays as photons would bring it, and no light twice."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import (
    ALL_RAYS,
    RAY_BITS,
    Light,
    Lobe,
    Material,
    Medium,
    Scene,
    sun_light,
    world_light,
)
from addon.photon.stage import find_needs
from addon.photon.stage.panes import _back_to_back, pane_of
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, camera, plain_material

from .test_glass import SLAB, WHITE, glass

BACKENDS = ["native", "fragment", "compute"]
GREY = plain_material("grey", (0.5, 0.4, 0.3))
DARK = plain_material("dark", (0.01, 0.01, 0.01))  # sends nothing to speak of back to the glass
FLOOR = ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
ABSORPTION = (0.5, 2.0, 6.0)  # [1/m]


def sun(angle: float, widest: float = 0.0) -> Light:
    """So many degrees from the zenith."""
    away = (math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle)))
    return replace(sun_light("sun", WHITE, tuple(-x for x in away)), parameters={"widest": widest})


def under(*materials: Material, lights: Any, floor: Material = GREY, **kwargs: Any) -> Scene:
    """A floor under slabs of 0.1 m, one of each material, seen from between."""
    built = Builder().quad(*FLOOR, 0)
    for number, _ in enumerate(materials, 1):
        built.box((-9, -9, number), (9, 9, number + 0.1), number)
    view = camera((0.3, 0.2, 0.8), (0, 0, 0), fov=40)
    return built.scene(view, lights, (floor, *materials), **kwargs)


def means(device: Device, scene: Scene, **settings: Any) -> dict[str, Any]:
    """Of the images, per channel."""
    settings = {"width": 32, "height": 32, "photons": 1 << 16, "passes": 4} | settings
    images = render(device, scene, **settings)
    return {name: images[name][..., :3].mean(axis=(0, 1), dtype=float) for name in images}


def let_through(angle: float, ior: float = 1.5) -> float:
    """By one face, unpolarised (Fresnel)."""
    cosine = math.cos(math.radians(angle))
    below = math.sqrt(1 - (1 - cosine**2) / ior**2)
    s = (cosine - ior * below) / (cosine + ior * below)
    p = (ior * cosine - below) / (ior * cosine + below)
    return 1 - 0.5 * (s * s + p * p)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("angle", [0, 45, 75])
def test_sun_through_a_slab(device: Device, backend: str, angle: float) -> None:
    """Two faces by shadow rays, without noise; what is reflected inside by photons."""
    scene = under(glass(), lights=(sun(angle),), floor=DARK)
    found = means(device, scene, backend=backend)
    lit = np.array(DARK.diffuse) / math.pi * math.cos(math.radians(angle))
    assert found["Direct"] == pytest.approx(lit * let_through(angle) ** 2, rel=1e-4)
    assert found["Combined"] == pytest.approx(lit * SLAB[angle], rel=0.01)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_it_is_made_of(device: Device, backend: str) -> None:
    """Two slabs, of which one is coloured and absorbs."""
    colour = (0.9, 0.7, 0.4)
    (lobe,) = glass().lobes
    dim = replace(glass(), lobes=(replace(lobe, colour=colour),), medium=Medium(ABSORPTION))
    found = means(device, under(dim, glass(1.3), lights=(sun(30),)), backend=backend)
    lit = np.array(GREY.diffuse) / math.pi * math.cos(math.radians(30))
    inside = 0.1 / math.sqrt(1 - (math.sin(math.radians(30)) / 1.5) ** 2)
    left = np.array(colour) ** 2 * np.exp(-inside * np.array(ABSORPTION))
    left *= let_through(30) ** 2 * let_through(30, 1.3) ** 2
    assert found["Direct"] == pytest.approx(lit * left, rel=1e-4)


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("low", "high"), [(1.05, 1.15), (1.1, 1.3), (0.95, 1.25)])
def test_bodies_that_overlap(device: Device, backend: str, low: float, high: float) -> None:
    """What absorbs adds up, as for photons: a bar within another, one that reaches out of it."""
    other = (3.0, 1.0, 0.0)
    bodies = [replace(glass(1.0), medium=Medium(of)) for of in (ABSORPTION, other)]
    built = Builder().quad(*FLOOR, 0).box((-9, -9, 1), (9, 9, 1.2), 1)
    built.box((-9.1, -9.1, low), (9.1, 9.1, high), 2)
    view = camera((0.3, 0.2, 0.8), (0, 0, 0), fov=40)
    found = means(device, built.scene(view, (sun(0),), (GREY, *bodies)), backend=backend)
    left = np.exp(-0.2 * np.array(ABSORPTION) - (high - low) * np.array(other))
    assert found["Direct"] == pytest.approx(np.array(GREY.diffuse) / math.pi * left, rel=1e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_behind_what_is_transparent(device: Device, backend: str) -> None:
    """A filter above, and one below the glass: what one alone takes, twice."""
    thin = Material("filter", (0.0,) * 3, (Lobe("transparent", (0.5, 0.6, 0.7)),))
    found = {}
    for number in (0, 1, 2):
        built = Builder().quad(*FLOOR, 0).box((-9, -9, 1), (9, 9, 1.1), 1)
        for z in (0.9, 1.3)[:number]:
            built.quad((-9, -9, z), (9, -9, z), (9, 9, z), (-9, 9, z), 2)
        view = camera((0.3, 0.2, 0.8), (0, 0, 0), fov=40)
        scene = built.scene(view, (sun(20),), (GREY, glass(), thin))
        found[number] = means(device, scene, backend=backend, photons=1 << 10)["Direct"]
    assert found[1] == pytest.approx(found[0] * (0.5, 0.6, 0.7), rel=1e-4)
    assert found[2] == pytest.approx(found[1] * (0.5, 0.6, 0.7), rel=1e-4)


def without(monkeypatch: pytest.MonkeyPatch) -> None:
    """Photons bring it all."""
    monkeypatch.setattr(find_needs, "has_panes", lambda *_: False)


ROUND = {"alpha_x": 0.3, "alpha_y": 0.3, "turn": 0.0, "compensated": 1.0, "ior": 1.5}
FINE = {"alpha_x": 0.05, "alpha_y": 0.05, "turn": 0.0, "compensated": 1.0}
GLAZE = Material(
    "glaze",
    (0.2, 0.3, 0.4),
    (Lobe("ggx_dielectric", (0.04,) * 3, ROUND, covered=(0.2, 0.3, 0.4)),),
)
SHARP = Material("sharp", (0.2, 0.3, 0.4), (Lobe("ggx", (0.4,) * 3, FINE),))


@pytest.mark.thorough("grey-sun", "sharp-sun", "glaze-sky", "sharp-sky", "glaze-sun")
@pytest.mark.parametrize(
    "lights", [(sun(40, 1e-3),), (world_light("world", WHITE),)], ids=["sun", "sky"]
)
@pytest.mark.parametrize("floor", [GREY, GLAZE, SHARP], ids=lambda x: x.name)
def test_as_by_photons_alone(
    device: Device, monkeypatch: pytest.MonkeyPatch, floor: Material, lights: Any, thorough: bool
) -> None:
    """A pit under glass, whatever its floor reflects: as bright, by light that comes once."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
    built.box((-1, -1, 0), (1, 1, 0.21), 1, skip="-z +z")
    built.box((-1.01, -1.01, 0.2), (1.01, 1.01, 0.25), 2)
    view = camera((0.06, 0.04, 0.18), (0, 0, 0), fov=40)
    scene = built.scene(view, lights, (floor, DARK, glass()))
    # By photons alone means of seeds are up to 3 % off.
    settings = {"passes": 32 if thorough else 16, "photons": 1 << 17, "mirror_depth": 8, "seed": 1}
    found = means(device, scene, **settings)
    without(monkeypatch)
    expected = means(device, scene, **settings)
    print(f"\n{floor.name}: {found['Combined']} by photons {expected['Combined']}")
    assert found["Direct"].min() > 1.2 * expected["Direct"].min()
    close = 0.01 if lights[0].kind == "sun" else 0.02  # of the world photons come from all around
    assert found["Combined"] == pytest.approx(expected["Combined"], rel=close)


@pytest.mark.thorough("fragment")
@pytest.mark.parametrize("backend", ["native", "fragment"])
def test_many_slabs(device: Device, backend: str) -> None:
    """Twenty-five, one above the other: what is left behind fifty faces."""
    built = Builder().quad(*FLOOR, 0)
    for z in 1 + 0.1 * np.arange(25):
        built.box((-9, -9, z), (9, 9, z + 0.05), 1)
    view = camera((0.3, 0.2, 0.8), (0, 0, 0), fov=40)
    scene = built.scene(view, (sun(20),), (GREY, glass()))
    settings = {"width": 8, "height": 8, "passes": 1, "photons": 1 << 10}
    found = means(device, scene, backend=backend, **settings)
    lit = np.array(GREY.diffuse) / math.pi * math.cos(math.radians(20))
    assert found["Direct"] == pytest.approx(lit * let_through(20) ** 50, rel=1e-3)


def test_other_glass_beside_a_pane(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Head-on, where it bends nothing: glass that is no pane is left to photons, as a ball is."""
    (lobe,) = glass().lobes
    refracts = replace(lobe, parameters={**lobe.parameters, "reflects": 0.0})
    other = Material("refraction", (0.0,) * 3, (refracts,))
    built = Builder().quad(*FLOOR, 0).box((-9, -9, 1), (0, 9, 1.1), 1)
    built.box((0.001, -9, 1), (9, 9, 1.1), 2).sphere((0.5, 0, 0.5), 0.2, 1)
    scene = built.scene(camera((0, 0, 0.95), (0, 0, 0), fov=80), (sun(0),), (GREY, glass(), other))
    settings = {"passes": 4, "photons": 1 << 16}
    found = means(device, scene, **settings)
    without(monkeypatch)
    expected = means(device, scene, **settings)
    assert found["Direct"].min() > 0.2 * expected["Combined"].min() > expected["Direct"].max()
    assert found["Combined"] == pytest.approx(expected["Combined"], rel=0.01)


@pytest.mark.parametrize(
    "limits", [{"found_by": ("diffuse",)}, {"max_bounces": 1}], ids=["glossy off", "one bounce"]
)
def test_none_of_limited_light(
    device: Device, monkeypatch: pytest.MonkeyPatch, limits: dict[str, Any]
) -> None:
    scene = under(glass(), lights=(replace(sun(10), **limits),))
    found = means(device, scene)
    without(monkeypatch)
    assert found["Combined"].tolist() == means(device, scene)["Combined"].tolist()


@pytest.mark.parametrize("hidden", ["shadow", "diffuse", "transmission"])
def test_none_where_surfaces_are_hidden(
    device: Device, monkeypatch: pytest.MonkeyPatch, hidden: str
) -> None:
    scene = under(glass(), lights=(sun(10),))
    visible = np.full(len(scene.surfaces), ALL_RAYS, np.uint8)
    visible[1] -= RAY_BITS[hidden]
    scene = replace(scene, visible=visible)
    found = means(device, scene)
    without(monkeypatch)
    assert found["Combined"].tolist() == means(device, scene)["Combined"].tolist()


def test_a_wedge_is_none(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Faces that are not parallel, by two degrees: nothing by shadow rays, all by photons."""
    rise = 18 * math.tan(math.radians(2))
    corners = np.array([[x, y, z] for z in (1, 1.2) for y in (-9, 9) for x in (-9, 9)], float)
    corners[4:, 2] += (corners[4:, 0] + 9) / 18 * rise
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    built = Builder().quad(*FLOOR, 0).add(corners, triangles, 1)
    view = camera((0.3, 0.2, 0.8), (0, 0, 0), fov=40)
    scene = built.scene(view, (sun(10),), (GREY, glass()))
    found = means(device, scene)
    without(monkeypatch)
    assert found["Direct"].max() == 0.0
    assert found["Combined"] == pytest.approx(means(device, scene)["Combined"], rel=1e-3)


def test_none_without_caustics(device: Device) -> None:
    """Where the scene shall have nothing that is refracted."""
    scene = under(glass(), lights=(sun(10),), caustics=("reflective",))
    assert means(device, scene)["Combined"].max() == 0.0


@pytest.mark.parametrize(
    "material",
    [
        glass(is_open=1.0),
        replace(glass(), diffuse=(0.1, 0.1, 0.1)),
        Material("frosted", (0.0,) * 3, (replace(glass().lobes[0], kind="ggx_glass"),)),
    ],
    ids=["sheet", "diffuse too", "rough"],
)
def test_what_is_none(material: Material) -> None:
    assert pane_of(material) is None and pane_of(glass()) == (1.5, WHITE)


def test_faces_back_to_back() -> None:
    """A box has some; three faces of it, one face, none and a wedge of thirty degrees have none."""
    box, normals = Builder().box((0, 0, 0), (1, 1, 1)), np.eye(3)
    assert _back_to_back(box.normals[0][:, 0])
    assert not any(map(_back_to_back, (normals, normals[:1], normals[:0])))
    assert not _back_to_back(np.array([[0, 0, 1], [0, 0.5, -(0.75**0.5)]]))
