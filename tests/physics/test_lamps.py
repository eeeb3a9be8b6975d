# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps light a floor by closed forms: by shadow rays, by photons, by rays of lobes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import (
    FOUND_BY,
    TRANSPARENT,
    Light,
    Lobe,
    Material,
    area_light,
    point_light,
    spot_light,
    sun_light,
)
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, orthographic, plain_material

POWER = (4.0, 2.0, 1.0)
WHITE = (1.0, 1.0, 1.0)
HALF = 0.6  # [m] of the floor
HEIGHT = 0.7
AT = (0.3, -0.2)  # where it is looked at
TILT = (0.6, 0.0, -0.8)


def polygon(corners: Any, place: Any) -> Any:
    """Irradiance over radiance at places (n, 3) that face +z (Lambert 1760): half the sum over the
    sides of the angle that each subtends times its normal's z."""
    to = np.asarray(corners)[None] - np.asarray(place)[:, None]
    to /= np.linalg.norm(to, axis=-1, keepdims=True)
    following = np.roll(to, -1, axis=1)
    angle = np.arccos((to * following).sum(axis=-1))
    normal = np.cross(to, following)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.abs((angle * normal[..., 2]).sum(axis=1)) / 2


def of_rectangle(size: Any, place: Any) -> Any:
    x, y = np.multiply(size, 0.5)
    corners = np.array([(-x, -y, HEIGHT), (x, -y, HEIGHT), (x, y, HEIGHT), (-x, y, HEIGHT)])
    return polygon(corners, place)


def of_disc(radius: float, place: Any) -> Any:
    """Of a parallel disc, at a distance from its axis (Foote 1915)."""
    h, a = HEIGHT / radius, np.linalg.norm(place[:, :2], axis=1) / radius
    z = 1 + h * h + a * a
    return math.pi / 2 * (1 - (z - 2) / np.sqrt(z * z - 4 * a * a))


def grating(size: Any, spread: float, place: Any) -> Any:
    """Irradiance over radiance of a rectangle behind slats, summed over its surface."""
    steps = (np.arange(400) + 0.5) / 400 - 0.5
    x, y = np.meshgrid(steps * size[0], steps * size[1])
    half = spread / 2
    found = []
    for at in place:
        beside2 = (x - at[0]) ** 2 + (y - at[1]) ** 2
        through = np.maximum(0, 1 - np.sqrt(beside2) / HEIGHT / math.tan(half))
        cosine4 = (HEIGHT**2 / (beside2 + HEIGHT**2)) ** 2 / HEIGHT**2
        gain = 1 / (1 - half / math.tan(half))
        found.append(gain * (through * cosine4).mean() * size[0] * size[1])
    return np.array(found)


@dataclass(frozen=True)
class Case:
    light: Light
    irradiance: Any  # [W/m^2] at places (n, 3), of a power of 1


def at(place: Any) -> tuple[Any, Any, Any]:
    """Of places as a light straight above the middle has them: directions, squared distances, and
    cosines on the floor."""
    to = np.asarray(place) - np.array([0.0, 0.0, HEIGHT])
    distance2 = (to**2).sum(axis=1)
    direction = to / np.sqrt(distance2)[:, None]
    return direction, distance2, -direction[:, 2]


def soft(place: Any) -> Any:
    _, distance2, cosine = at(place)
    return cosine / (4 * math.pi * (distance2 + RADIUS**2))


def stretched(place: Any) -> Any:
    """A cone of 80 deg without blend, stretched."""
    direction, distance2, cosine = at(place)
    local = direction / (*STRETCH, 1.0)
    inside = -local[:, 2] / np.linalg.norm(local, axis=1) > math.cos(math.radians(40))
    return inside * cosine / (4 * math.pi * distance2)


def brightness(polar: Any, azimuth: Any) -> Any:
    return (0.3 + np.cos(polar) ** 2) * (1 + 0.5 * np.cos(azimuth - 0.7))


def profile(place: Any) -> Any:
    """Azimuths of IES files: 0 points against y, 90 deg against x."""
    direction, distance2, cosine = at(place)
    azimuth = np.arctan2(-direction[:, 0], -direction[:, 1])
    return brightness(np.arccos(cosine), azimuth) * cosine / (4 * math.pi * distance2)


def falling_off(place: Any) -> Any:
    """A small light, linearly and smoothly."""
    _, distance2, cosine = at(place)
    return np.sqrt(distance2) / (0.4 + distance2) * cosine / (4 * math.pi)


def lamp(name: str, size: tuple[float, float], is_round: bool, spread: float = math.pi) -> Light:
    position = (0.0, 0.0, HEIGHT)
    return area_light(name, position, POWER, size=size, is_round=is_round, spread=spread)


STRETCH = (1.5, 0.6)
PROFILE = brightness(np.linspace(0, math.pi, 181)[:, None], np.radians(np.arange(0, 360, 5)))
ABOVE = (0.0, 0.0, HEIGHT)
CONE = {"size": math.radians(80), "blend": 0.0}
BARE = point_light("linear", ABOVE, POWER)
SIZE, SLATS = (0.5, 1.2), math.radians(80)
AREA = SIZE[0] * SIZE[1]
RADIUS = 0.45
CASES = (
    Case(lamp("rectangle", SIZE, False), lambda x: of_rectangle(SIZE, x) / (math.pi * AREA)),
    Case(
        lamp("disc", (2 * RADIUS,) * 2, True),
        lambda x: of_disc(RADIUS, x) / (math.pi**2 * RADIUS**2),
    ),
    Case(
        lamp("softbox", SIZE, False, SLATS),
        lambda x: grating(SIZE, SLATS, x) / (math.pi * AREA),
    ),
    Case(point_light("soft", ABOVE, POWER, RADIUS, soft=True), soft),
    Case(spot_light("stretched", ABOVE, POWER, **CONE, stretch=STRETCH), stretched),
    Case(
        replace(point_light("ies", ABOVE, POWER), profile=tuple(map(tuple, PROFILE.tolist()))),
        profile,
    ),
    Case(replace(BARE, falloff=1, smoothing=0.4), falling_off),
    Case(sun_light("delta sun", POWER, TILT), lambda x: np.full(len(x), 0.8)),
    Case(sun_light("sun", POWER, TILT, math.radians(5)), lambda x: np.full(len(x), 0.8)),
)
EACH = [pytest.param(case, id=case.light.name) for case in CASES]


def floor(light: Light, material: Material, size: float = 0.01) -> Any:
    view = orthographic((*AT, 0.4), (1, 0, 0), (0, 1, 0), size)
    a = HALF
    built = Builder().quad((-a, -a, 0), (a, -a, 0), (a, a, 0), (-a, a, 0))
    return built.scene(view, [light], [material])


@pytest.mark.parametrize("case", EACH)
def test_by_shadow_rays(device: Device, case: Case) -> None:
    light = replace(case.light, found_by=("diffuse",))
    scene = floor(light, plain_material("grey", (0.5,) * 3))
    images = render(device, scene, width=32, height=32, passes=24, photons=0)
    found = images["Combined"][..., :3].mean(axis=(0, 1)) * math.pi / 0.5
    expected = np.multiply(POWER, case.irradiance(np.array([(*AT, 0.0)])))
    np.testing.assert_allclose(found, expected, 5e-3)


@pytest.mark.parametrize("case", EACH)
def test_by_photons(device: Device, case: Case) -> None:
    """What falls on all of the floor."""
    many = 20 if case.light.name == "softbox" else 200
    steps = ((np.arange(many) + 0.5) / many * 2 - 1) * HALF
    x, y = np.meshgrid(steps, steps)
    places = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], -1)
    expected = np.multiply(POWER, case.irradiance(places).mean() * 4 * HALF**2)
    scene = floor(case.light, plain_material("grey", (0.5,) * 3))
    settings: dict[str, Any] = {"width": 8, "height": 8, "photons": 300_000, "radius": 0.2}
    with rendered(device, scene, **settings, direct_by_photons=True) as renderer:
        np.testing.assert_allclose(fallen(renderer)[0], expected, 5e-3)


WIDE_SUN = sun_light("wide sun", POWER, TILT, math.radians(40))


@pytest.mark.thorough("0.1-softbox", "0.1-wide sun", "0.5-disc", "0.5-rectangle")
@pytest.mark.parametrize(
    "light", [*(case.light for case in CASES[:3]), WIDE_SUN], ids=lambda light: light.name
)
@pytest.mark.parametrize("alpha", [0.0, 0.1, 0.5])
def test_by_lobes(device: Device, light: Light, alpha: float) -> None:
    """Rays of lobes, shadow rays, and both in their shares show the same highlight; a mirror the
    light itself."""
    parameters = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 0.0}
    lobe = Lobe("ggx", WHITE, parameters) if alpha else Lobe("mirror", WHITE)
    material = Material("glossy", (0.0,) * 3, (lobe,))
    found = {}
    ways = {"lobes": ("chains",), "shadow rays": ("glossy",), "both": ("glossy", "chains")}
    for way, found_by in ways.items():
        scene = floor(replace(light, found_by=found_by), material, 1.0)
        tilted = np.array([[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]]).T  # sees sun and lamp
        scene.camera.matrix[:3, :3] = tilted
        scene.camera.matrix[:3, 3] = tilted @ (0.0, 0.0, 3.0)
        images = render(device, scene, width=64, height=64, passes=32, photons=0)
        found[way] = images["Combined"][..., :3].mean(axis=(0, 1))
    assert found["lobes"].min() > 0
    if not alpha:
        assert not found["shadow rays"].any()
        np.testing.assert_array_equal(found["both"], found["lobes"])
        return
    np.testing.assert_allclose(found["lobes"], found["both"], 1e-2)
    np.testing.assert_allclose(found["shadow rays"], found["both"], 1e-2)


@pytest.mark.parametrize("veiled", [False, True])
@pytest.mark.parametrize("hidden", ["", "diffuse", "glossy"])
def test_photons_of_what_surfaces_find(device: Device, hidden: str, veiled: bool) -> None:
    """A light that diffuse or glossy surfaces do not find throws nothing back from them, behind
    what is transparent neither."""
    found_by = tuple(name for name in ("diffuse", "glossy") if name != hidden)
    light = replace(CASES[0].light, found_by=found_by)
    view = orthographic((0.0, 0.0, 0.4), (1, 0, 0), (0, 1, 0), 0.5)
    a = HALF
    for material, by in ((0, "diffuse"), (1, "glossy")):
        built = Builder().quad((-a, -a, 0), (a, -a, 0), (a, a, 0), (-a, a, 0), material)
        built.quad((-a, -a, 2), (-a, a, 2), (a, a, 2), (a, -a, 2))
        if veiled:
            built.quad((-a, -a, 0.5), (a, -a, 0.5), (a, a, 0.5), (-a, a, 0.5), 2)
        materials = [plain_material("grey"), plain_material("mirror", (0.0,) * 3, (0.9,) * 3)]
        materials.append(Material("clear", (0.0,) * 3, (Lobe(TRANSPARENT, (0.9,) * 3),)))
        scene = built.scene(view, [light], materials)
        with rendered(device, scene, width=8, height=8, photons=20_000, radius=0.2) as renderer:
            assert fallen(renderer)[1].any() == (by != hidden)


@pytest.mark.parametrize("hidden", ["", "diffuse", "glossy"])
def test_rough_diffuse_lobes_are_diffuse(device: Device, hidden: str) -> None:
    """They find what Lambert's lobe finds, by shadow rays and by photons, whatever rays of gloss
    find."""
    found_by = {"": FOUND_BY, "diffuse": ("glossy", "chains"), "glossy": ("diffuse",)}[hidden]
    light = replace(CASES[0].light, found_by=found_by)
    rough = Lobe("oren_nayar", (0.5,) * 3, {"diffuse_roughness": 1.0})
    material, a = Material("rough", (0.0,) * 3, (rough,)), HALF
    built = Builder().quad((-a, -a, 0), (a, -a, 0), (a, a, 0), (-a, a, 0))
    built.quad((-a, -a, 2), (-a, a, 2), (a, a, 2), (a, -a, 2), 1)
    view = orthographic((0.0, 0.0, 0.4), (1, 0, 0), (0, 1, 0), 0.5)
    scene = built.scene(view, [light], [material, plain_material("grey")])
    with rendered(device, scene, width=8, height=8, photons=20_000, radius=0.2) as renderer:
        seen, thrown_back = renderer.images()["Direct"][..., :3].mean(), fallen(renderer)[1].any()
    assert (seen > 0.05, thrown_back) == (hidden != "diffuse",) * 2
