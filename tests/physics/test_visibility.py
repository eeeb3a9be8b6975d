# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that not all rays meet, and lights that are limited: closed forms of spheres about a
light.

The outer sphere has radius 1, the albedo rho, and a light of I = 1 W/sr at its centre; a shell of
half the radius has the albedo sigma.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import ALL_RAYS, HOLDOUT, MIRROR, RAY_BITS, Lobe, Material, Scene
from addon.streams import Device
from tests.measure import render
from tests.physics.test_glass import glass
from tests.scenes import (
    UNIT_INTENSITY,
    Builder,
    camera,
    cornell,
    plain_light,
    plain_material,
    replace,
)

CAMERA, DIFFUSE, GLOSSY, _, SHADOW = RAY_BITS.values()
RHO, SIGMA = 0.5, 0.8
VIEW_OUT = camera((0.0, 0.7, 0.0), (0.0, 2.0, 0.1), 120)  # at the outer sphere, from between them
VIEW_IN = camera((0.0, 0.95, 0.0), (0.0, 0.0, 0.0), 40)  # at the shell


def spheres(shell: int, view: Any = VIEW_OUT, specular: float = 0.0, **light: Any) -> Scene:
    """Both, the shell met by rays of some bits."""
    wall, thing = plain_material("wall", (RHO,) * 3), plain_material("shell", (SIGMA,) * 3)
    if specular:
        thing = plain_material("shell", (0.0,) * 3, (specular,) * 3, MIRROR)
    built = Builder().sphere((0, 0, 0), 1.0, 0, "wall").sphere((0, 0, 0), 0.5, 1, "shell")
    lamp = plain_light("lamp", "POINT", (0, 0, 0), (UNIT_INTENSITY,) * 3)
    scene = built.scene(view, [replace(lamp, **light)], [wall, thing])
    return replace(scene, visible=np.array([ALL_RAYS, shell], np.uint8))


def seen(device: Device, scene: Scene, **settings: Any) -> float:
    """The mean radiance."""
    given = {"passes": 4, "photons": 40000, "width": 16, "height": 16, "radius": 0.1}
    return float(render(device, scene, **given | settings)["Combined"][..., :3].mean())


def near(expected: float) -> Any:
    return pytest.approx(expected, rel=0.015)


@pytest.mark.parametrize("by_photons", [False, True])
def test_what_no_ray_meets_is_not_there(device: Device, by_photons: bool) -> None:
    found = seen(device, spheres(0), direct_by_photons=by_photons)
    assert found == near(RHO / (1 - RHO) / math.pi)


@pytest.mark.parametrize("by_photons", [False, True])
def test_light_passes_what_shadow_rays_do_not_meet(device: Device, by_photons: bool) -> None:
    """It falls on the wall as if there were no shell, and a quarter of what the wall reflects meets
    that one, which reflects it back."""
    scene = spheres(DIFFUSE)
    radiosity = RHO / (1 - 0.75 * RHO - 0.25 * RHO * SIGMA)
    found = seen(device, scene, direct_by_photons=by_photons)
    assert found == near(radiosity / math.pi)


def test_what_only_the_eye_sees_is_lit(device: Device) -> None:
    """And changes nothing: the wall shines on it as if it were not there."""
    scene, wall, many = spheres(CAMERA, VIEW_IN), RHO / (1 - RHO), 100_000
    assert seen(device, scene, photons=many) == near(SIGMA * wall / math.pi)
    outside = seen(device, replace(scene, camera=VIEW_OUT), photons=many)
    assert outside == near(wall / math.pi)


def test_what_only_shadow_rays_meet_only_shadows(device: Device) -> None:
    assert seen(device, spheres(SHADOW)) == 0.0


def test_a_light_without_shadow(device: Device) -> None:
    """As if shadow rays met nothing."""
    radiosity = RHO / (1 - 0.75 * RHO - 0.25 * RHO * SIGMA)
    found = seen(device, spheres(ALL_RAYS, casts_shadow=False))
    assert found == near(radiosity / math.pi)


@pytest.mark.parametrize("bounces", [0, 1, 3])
def test_max_bounces(device: Device, bounces: int) -> None:
    """A bounce is a term of the geometric series."""
    series = sum(RHO**k for k in range(1, bounces + 2))
    found = seen(device, spheres(0, max_bounces=bounces))
    assert found == near(series / math.pi)


def test_mirrors_show_what_their_rays_meet(device: Device) -> None:
    """The shell mirrors the wall, which is not there for its rays; and the other way round."""
    mirror = spheres(CAMERA, VIEW_IN, 0.9)
    wall = RHO / (1 - RHO) / math.pi
    assert seen(device, mirror) == near(0.9 * wall)
    hidden = replace(mirror, visible=np.array([ALL_RAYS - GLOSSY, CAMERA], np.uint8))
    assert seen(device, hidden) == 0.0
    through = replace(mirror, visible=np.array([ALL_RAYS, GLOSSY], np.uint8))
    assert seen(device, through) == near(wall)  # the wall behind it


# What is seen by or through which things, and which rays see it: straight on they stay what they
# were; whatever goes through glass is of transmission.
SEEN = {
    (): "camera",
    ("clear",): "camera",
    ("glass",): "transmission",
    ("mirror",): "glossy",
    ("mirror", "clear"): "glossy",
    ("glass", "clear"): "transmission",
}


def wall_behind(things: tuple[str, ...], rays: str) -> Scene:
    """A lit wall, and what it is seen by or through; rays of one kind meet it."""
    clear = Material("clear", (0.0,) * 3, (Lobe("transparent", (0.9,) * 3),))
    wall, mirror = (
        plain_material("wall", (RHO,) * 3),
        plain_material("", (0,) * 3, (0.9,) * 3, MIRROR),
    )
    lamp = plain_light("lamp", "POINT", (0, 0, 1), (UNIT_INTENSITY,) * 3)
    built = Builder().quad((-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0), 0, "wall")
    if "clear" in things:
        built.quad((-5, -5, 1.5), (5, -5, 1.5), (5, 5, 1.5), (-5, 5, 1.5), 1, "clear")
    if "glass" in things:
        built.box((-5, -5, 2), (5, 5, 2.1), 2, "glass")
    if "mirror" in things:
        built.quad((-5, -5, 4), (-5, 5, 4), (5, 5, 4), (5, -5, 4), 3, "mirror")
    view = camera((0.1, 0.1, 3), (0, 0, 9 if "mirror" in things else 0), 20)
    scene = built.scene(view, [lamp], [wall, clear, glass(), mirror])
    visible = [
        RAY_BITS[rays] + SHADOW if x == "wall" else ALL_RAYS - SHADOW for x in scene.surfaces
    ]
    return replace(scene, visible=np.array(visible, np.uint8))


@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
def test_rays_that_go_on_meet_what_is_visible_to_their_kind(device: Device, backend: str) -> None:
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    for rays in ("camera", "diffuse", "glossy", "transmission"):
        for things, kind in SEEN.items():
            scene = wall_behind(things, rays)
            found = seen(device, scene, backend=backend, photons=0, passes=8)
            assert found > 0.01 if rays == kind else found == 0.0, (things, rays)


def test_holdout_is_a_hole(device: Device) -> None:
    """For the eye alone: what it lights and shows in mirrors stays."""
    scene = spheres(CAMERA + HOLDOUT, VIEW_IN)
    scene = replace(scene, camera=camera((0, 0.95, 0), (0, 0, 0), 100))
    given: dict[str, Any] = {"width": 24, "height": 24, "photons": 20000}
    image = render(device, scene, **given)["Combined"]
    plain = replace(scene, visible=np.array([ALL_RAYS, CAMERA], np.uint8))
    before = render(device, plain, **given)["Combined"]
    hole = image[..., 3] == 0.0
    assert 0.1 < hole.mean() < 0.5 and hole[12, 12] and not image[hole].any()
    assert edge_free(image, hole) == edge_free(before, hole)
    mirrored = spheres(ALL_RAYS, VIEW_IN, 0.9)
    mirrored = replace(mirrored, visible=np.array([HOLDOUT + ALL_RAYS, CAMERA], np.uint8))
    assert seen(device, mirrored) == near(0.9 * RHO / (1 - RHO) / math.pi)


@pytest.mark.thorough("True-lists")
@pytest.mark.parametrize("layer", ["fragment", "compute", "lists"])
@pytest.mark.parametrize("by_photons", [False, True])
def test_layers_agree(
    device: Device, monkeypatch: pytest.MonkeyPatch, layer: str, by_photons: bool
) -> None:
    """Where photons pass, scatter by a lobe, and count bounces; "lists" are what GPUs keep."""
    if layer != "fragment" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    scene = cornell(mirror=True, lobe=True)
    visible = np.full(len(scene.surfaces), ALL_RAYS, np.uint8)
    visible[5:] = GLOSSY + DIFFUSE, CAMERA + SHADOW + DIFFUSE  # box and ball
    visible[2:4] = ALL_RAYS - DIFFUSE, ALL_RAYS + HOLDOUT  # the walls behind and to the left
    (lamp,) = scene.lights
    lamps = (replace(lamp, max_bounces=2), replace(lamp, casts_shadow=False))
    scene = replace(scene, visible=visible, lights=lamps)
    given: dict[str, Any] = {"width": 24, "height": 24, "photons": 4000, "passes": 2}
    given["direct_by_photons"] = by_photons
    other = render(device, scene, backend="native", **given)
    if layer == "lists":
        monkeypatch.setattr(device, "prefers_native", False)
    one = render(device, scene, backend="fragment" if layer == "fragment" else "compute", **given)
    for name in ("Combined", "Direct", "Indirect", "Mirror"):
        assert one[name].mean() > 0.0 or (by_photons and name == "Direct")
        close = np.isclose(one[name], other[name], rtol=1e-3, atol=1e-3 * other[name].mean())
        assert close.mean() > 0.99, name


def edge_free(image: NDArray[Any], hole: NDArray[Any]) -> list[float]:
    whole = image[~hole & (image[..., 3] == 1.0)]
    return [float(x) for x in whole.sum(axis=0)]
