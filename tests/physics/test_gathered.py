# SPDX-License-Identifier: GPL-3.0-or-later
"""Lobes that gather photons show what their rays would: natively, by fragment and by compute
programs, and whatever share of a lobe does either."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.denoiser import find
from addon.photon.film.picture import PARTS
from addon.photon.scene import Lobe, Material, Scene, phong, world_light
from addon.photon.stage import gathered
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, camera, cornell, plain_light, replace
from tests.unit.test_denoiser import needs_it

BLACK = (0.0, 0.0, 0.0)
ROUGHNESS = 0.5


def microfacets(kind: str, colour: Any, **more: Any) -> Lobe:
    alpha = ROUGHNESS**2
    shape = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0}
    return Lobe(kind, colour, shape | more)


METAL = microfacets("ggx_metal", (0.5, 0.4, 0.2), tint=(0.8, 0.9, 1.0))
COAT = microfacets("ggx_dielectric", (0.04,) * 3, ior=1.5)
PHONG = phong((0.4, 0.4, 0.2), 2 / ROUGHNESS**4 - 2)
MATERIALS = {
    "phong": Material("phong", (0.2, 0.3, 0.1), (PHONG,)),
    "metal": Material("metal", BLACK, (METAL,)),
    "two": Material("two", (0.1, 0.1, 0.2), (COAT, phong((0.3, 0.2, 0.1), 20.0))),
}


def room(material: Material) -> Scene:
    """A closed room whose every wall wears it."""
    scene = cornell()
    view = camera((5, 0.5, 5), (5, 10, 4), 70)
    return replace(scene, camera=view, materials=(material,) * len(scene.materials))


def share(monkeypatch: pytest.MonkeyPatch, of_lobe: float) -> None:
    """Gather photons with such a share of lobes of ROUGHNESS: 0, 0.5 or 1."""
    begin = {0.0: 2.0, 0.5: ROUGHNESS - 0.2, 1.0: 0.1}[of_lobe]
    end = {0.0: 3.0, 0.5: ROUGHNESS + 0.2, 1.0: 0.2}[of_lobe]
    monkeypatch.setattr(gathered, "GATHERED_FROM", begin)
    monkeypatch.setattr(gathered, "GATHERED_WHOLLY", end)
    both = {"GATHERED_FROM": begin, "GATHERED_WHOLLY": end}
    for name, value in both.items():
        monkeypatch.setitem(gathered.BLEND, name, value)


def seen_send_rays(monkeypatch: pytest.MonkeyPatch, **options: Any) -> dict[str, Any]:
    """Settings by which what the eye sees sends rays, and gathers wherever those end."""
    if find() is None:
        pytest.skip("OpenImageDenoise is not here")
    share(monkeypatch, 1.0)
    seen = {"SEEN_GATHERED_FROM": 2.0, "SEEN_GATHERED_WHOLLY": 3.0}
    for name, value in seen.items():
        monkeypatch.setattr(gathered, name, value)
        monkeypatch.setitem(gathered.SEEN_BLEND, name, value)
    return {**options, "denoise": True}


def light(images: dict[str, Any]) -> Any:
    """But for the lamps' own: the mean of each quarter of the picture."""
    seen = (images["Indirect"] + images["Mirror"])[..., :3].astype(float)
    side = len(seen) // 2
    return seen.reshape(2, side, 2, side, 3).mean(axis=(1, 3)).reshape(4, 3)


FEW = ("phong",)  # the others take long


@pytest.mark.parametrize(
    "name",
    [pytest.param(x, marks=() if x in FEW else pytest.mark.thorough) for x in MATERIALS],
)
def test_gathered_is_what_rays_see(
    device: Device, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """And nothing jumps where the share of a lobe that gathers changes (stability row 64)."""
    options: dict[str, Any] = {"width": 12, "height": 12, "photons": 8192, "radius": 0.8}
    options |= {"passes": 160, "radius_decay": 2 / 3}
    found = {}
    for of_lobe in (0.0, 0.5, 1.0):
        share(monkeypatch, of_lobe)
        images = render(device, room(MATERIALS[name]), **options)
        found[of_lobe] = light(images)
        assert images["Mirror"].any() == (of_lobe < 1.0)
    for of_lobe in (0.5, 1.0):
        print(found[of_lobe].mean() / found[0.0].mean() - 1)
        np.testing.assert_allclose(found[of_lobe], found[0.0], atol=0.1 * found[0.0].mean())
        np.testing.assert_allclose(found[of_lobe].mean(), found[0.0].mean(), rtol=0.01)


@pytest.mark.parametrize(
    ("name", "backend"),
    [
        pytest.param(x, way, marks=() if (x, way) == ("phong", "native") else pytest.mark.thorough)
        for x in MATERIALS
        for way in ("native", "fragment", "compute")
    ],
)
def test_what_is_seen_sends_rays(
    device: Device, monkeypatch: pytest.MonkeyPatch, name: str, backend: Any
) -> None:
    """And what those meet gathers, where a picture is denoised: as much light as by rays alone."""
    options: dict[str, Any] = {"width": 12, "height": 12, "photons": 8192, "radius": 0.8}
    options |= {"passes": 160, "radius_decay": 2 / 3, "backend": backend}
    share(monkeypatch, 0.0)
    by_rays = light(render(device, room(MATERIALS[name]), **options))
    images = render(device, room(MATERIALS[name]), **seen_send_rays(monkeypatch, **options))
    found = light(images)
    np.testing.assert_allclose(found, by_rays, atol=0.1 * by_rays.mean())
    np.testing.assert_allclose(found.mean(), by_rays.mean(), rtol=0.015)
    share(monkeypatch, 1.0)
    gathered_first = render(device, room(MATERIALS[name]), **options | {"passes": 1})
    assert images["Mirror"].any() and not gathered_first["Mirror"].any()


@needs_it
@pytest.mark.parametrize("case", ["mirror", "first hits", "lamp of a size", "no mirror"])
def test_where_what_is_seen_sends_rays(device: Device, case: str) -> None:
    """Not where these miss what photons bring: a lamp of no size in a mirror, or light that no
    shadow ray finds. There a denoised picture is made of the same light, to the last bit."""
    scene = room(MATERIALS["metal"])
    lights = [replace(x, parameters={**x.parameters, "radius": 0.0}) for x in scene.lights]
    if case == "lamp of a size":
        lights = [replace(x, parameters={**x.parameters, "radius": 0.3}) for x in lights]
    mirror = Material("mirror", BLACK, (Lobe("mirror", (0.9, 0.9, 0.9)),))
    shiny = (scene.materials[0], mirror, *scene.materials[2:])
    materials = scene.materials if case == "no mirror" else shiny
    scene = replace(scene, lights=tuple(lights), materials=materials)
    options: dict[str, Any] = {"width": 12, "height": 12, "photons": 2048, "passes": 2}
    options["direct_by_photons"] = case == "first hits"
    plain, denoised = (render(device, scene, denoise=x, **options) for x in (False, True))
    alike = [np.array_equal(plain[name], denoised[name]) for name in PARTS]
    assert plain["Indirect"].any() and all(alike) == (case in ("mirror", "first hits"))


@pytest.mark.thorough
@pytest.mark.parametrize("name", MATERIALS)
def test_lights_are_seen_once(device: Device, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """By shadow rays and by rays of lobes together: a lamp of some size, and the world."""
    built = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    lamp = plain_light("lamp", "POINT", (0.0, 1.2, 1.0), (60.0, 40.0, 30.0), radius=0.4)
    lights = [lamp, world_light("sky", (0.3, 0.4, 0.5))]
    plate = built.scene(camera((0, -2.5, 2), (0, 0.3, 0), 25), lights, [MATERIALS[name]])
    options: dict[str, Any] = {"width": 16, "height": 16, "photons": 64, "passes": 56}
    found = []
    for of_lobe in (0.0, 0.5, 1.0):
        share(monkeypatch, of_lobe)
        images = render(device, plate, **options)
        found.append(images["Combined"][..., :3].astype(float).mean(axis=(0, 1)))
    np.testing.assert_allclose(found[1], found[0], rtol=0.01)
    np.testing.assert_allclose(found[2], found[0], rtol=0.01)
    images = render(device, plate, **seen_send_rays(monkeypatch, **options))
    parts = sum(images[part][..., :3].astype(float).mean(axis=(0, 1)) for part in PARTS)
    np.testing.assert_allclose(parts, found[0], rtol=0.01)  # Combined is denoised


@pytest.mark.thorough("metal-compute", "two-fragment", "phong-compute")
@pytest.mark.parametrize("layer", ["fragment", "compute"])
@pytest.mark.parametrize("name", MATERIALS)
def test_all_ways_gather_alike(
    device: Device, monkeypatch: pytest.MonkeyPatch, layer: str, name: str
) -> None:
    """Phong's lobes natively by powers of their own; photons' directions to the last bit."""
    if layer == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    share(monkeypatch, 0.5)
    options: dict[str, Any] = {"width": 16, "height": 16, "photons": 4096, "radius": 1.5}
    native, other = (
        render(device, room(MATERIALS[name]), passes=2, backend=way, **options)["Indirect"]
        for way in ("native", layer)
    )
    assert native.mean() > 0.01
    assert (np.abs(other - native) > 2e-3 * native.max()).mean() < 0.01
    np.testing.assert_allclose(other.mean(axis=(0, 1)), native.mean(axis=(0, 1)), rtol=2e-3)


@pytest.mark.thorough("two-native", "compute", "metal-fragment")
@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
@pytest.mark.parametrize("lobes", [(METAL,), (COAT, METAL)], ids=["metal", "two"])
def test_the_world_is_found_where_they_reflect_most(
    device: Device, backend: Any, lobes: tuple[Lobe, ...]
) -> None:
    """What gathers photons sends no rays: shadow rays to the world go by it, too. As much light as
    by rays alone, from close above a plate, and no specks."""
    built = Builder().quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))
    view = camera((0, -5, 0.7), (0, 0, 0), 30)
    scene = built.scene(view, [world_light("sky", (1.0, 0.8, 0.6))], [Material("", BLACK, lobes)])
    scene = replace(
        scene, lights=(replace(scene.lights[0], found_by=("diffuse", "glossy", "chains")),)
    )
    size = {"width": 24, "height": 24, "passes": 32, "backend": backend}
    lit = slice(0, 10)  # rows below the horizon
    by_rays, found = (
        render(device, scene, photons=photons, **size)["Combined"][lit, :, :3].astype(float)
        for photons in (0, 4096)
    )
    np.testing.assert_allclose(found.mean(axis=(0, 1)), by_rays.mean(axis=(0, 1)), rtol=0.02)
    assert (found.std(axis=(0, 1)) < 0.15 * found.mean(axis=(0, 1))).all()
