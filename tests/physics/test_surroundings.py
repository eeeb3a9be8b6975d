# SPDX-License-Identifier: GPL-3.0-or-later
"""Things on a plain of kilometres have the light that comes from all of it, and no more noise than
on ten metres."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.photons import aim, surroundings
from addon.photon.photons.mapper import PhotonBatch
from addon.photon.photons.portals import NO_PORTALS
from addon.photon.renderer import Renderer
from addon.photon.scene import Light, Lobe, Material, Scene, area_light, sun_light, world_light
from addon.streams import Device
from tests.measure import fallen, rendered
from tests.scenes import DIM, Builder, camera, plain_material

GROUND = plain_material("ground", (0.5, 0.4, 0.3))
WHITE = plain_material("white", (0.8, 0.8, 0.8))
ROUND = {"alpha_x": 0.09, "alpha_y": 0.09, "turn": 0.0, "compensated": 1.0, "ior": 1.5}
GLAZE = Lobe("ggx_dielectric", (0.04,) * 3, ROUND, covered=(0.5, 0.4, 0.3))
GLAZED = Material("glazed", (0.0,) * 3, (GLAZE,))
COAT = Lobe("coat", (0.5, 0.8, 0.9), {"alpha": 0.2, "ior": 1.6, "cover": 0.8})
DULL = Lobe("oren_nayar", (0.5, 0.4, 0.3), {"diffuse_roughness": 0.8}, over=0)
COATED = Material("coated", (0.0,) * 3, (COAT, DULL))
DOWN = np.array((0.3, 0.5, -0.8)) / np.linalg.norm((0.3, 0.5, -0.8))
SUN = sun_light("sun", (3.0,) * 3, tuple(DOWN), 0.01)
SKY = world_light("sky", (0.6, 0.8, 1.0))
SETTINGS: dict[str, Any] = {"width": 8, "height": 8, "photons": 20000, "radius": 0.1}
SIDE, HEIGHT = 0.4, 2.0  # [m] of a cube, and of its middle above the plain


def on_a_plain(half: float, at: tuple[float, float] = (0.0, 0.0)) -> Builder:
    """Two by `half` metres wide about `at`."""
    (x, y), low = at, -half
    corners = [(x + a, y + b, 0) for a, b in ((low, low), (half, low), (half, half), (low, half))]
    return Builder().quad(*corners, 0, "plain")


def cube(half: float, at: Any = (0.0, 0.0), middle: Any = (0.0, 0.0)) -> Scene:
    """Above a plain about `middle`."""
    x, y, near = *at, SIDE / 2
    built = on_a_plain(half, middle)
    low, high = (x - near, y - near, HEIGHT - near), (x + near, y + near, HEIGHT + near)
    built.box(low, high, 1, "cube")
    eye = camera((x + 1.0, y - 2.0, 2.2), (x, y, HEIGHT), 20)
    return built.scene(eye, (SUN,), [GROUND, DIM])


def boxes(half: float, *lights: Light, ground: Material = GROUND) -> Scene:
    """Two of a metre beside each other."""
    built = on_a_plain(half)
    built.box((-1.2, -0.5, 0), (-0.2, 0.5, 1), 1, "one")
    built.box((0.3, -0.4, 0), (1.3, 0.6, 1.2), 1, "other")
    return built.scene(camera((2.5, -4, 4), (0, 0, 0.5), 35), lights, [ground, WHITE])


def studio() -> Scene:
    """Small blocks on a wide floor under three area lights and a world."""
    built = on_a_plain(12.0)
    for turn in range(8):
        x, y = (0.35 * f(0.25 * np.pi * turn) for f in (np.cos, np.sin))
        built.box((x - 0.1, y - 0.1, 0.0), (x + 0.1, y + 0.1, 0.1 + 0.05 * turn), 0, f"{turn}")
    lamps = [
        area_light(f"{x}", (x, y, 3.0), (power,) * 3, size=(1.0, 1.0))
        for x, y, power in ((2.0, -2.0, 300.0), (-3.0, -1.0, 120.0), (0.0, 3.0, 150.0))
    ]
    eye = camera((1.2, -1.6, 1.2), (0.0, 0.0, 0.15), 40)
    return built.scene(eye, [world_light("sky", (1.0,) * 3), *lamps], [GROUND])


def test_light_of_a_world_on_small_things(device: Device) -> None:
    """Of its photons that start anywhere about a floor hardly one comes to what stands on it, and
    that one would bring what many do."""
    parts, settings = [], {"width": 64, "height": 64, "photons": 20000, "passes": 4}
    for seed in range(8):
        with rendered(device, studio(), **settings, seed=seed) as renderer:
            parts.append(renderer.images(["Indirect"])["Indirect"])
    mean, spread = np.mean(parts, axis=0), np.var(parts, axis=0, ddof=1)
    noise = float(np.mean(spread / (mean**2 + mean.mean() ** 2)))
    print(f"relative variance {noise:.3g}")
    assert noise < 0.09


def falls(renderer: Renderer, passes: int = 32) -> NDArray[Any]:
    """The flux [W] that bounces bring to what is not the plain, of passes, (passes,)."""
    assert renderer.photons
    mapper, found = renderer.photons.mapper, []
    for index in range(passes):
        mapper.start(PhotonBatch(100 + index, renderer.settings.photons_a_pass))
        place, deposit = mapper.finish().arrays()
        flux = deposit[place[:, 3] > 1.0, :3].mean(axis=1)
        found.append(flux.sum(dtype=float) * renderer.frame.scale**2)
    return np.array(found)


def test_small_things_have_all_light(device: Device) -> None:
    """As much, and with less noise, as of photons that start by flux alone."""
    with rendered(device, studio(), **SETTINGS) as renderer:
        tables = renderer.eye._tables
        assert tables.aims and 0 in tables.aims.by_light  # the world's
        aimed = falls(renderer, passes=64)
        tables.aim(None)
        plain = falls(renderer, passes=64)
    off = aimed.mean() / plain.mean() - 1.0
    chance = np.sqrt((aimed.var(ddof=1) + plain.var(ddof=1)) / len(plain)) / plain.mean()
    print(f"off by {off:.3f} +- {chance:.3f}; noise {aimed.std() / plain.std():.2f} of it")
    assert abs(off) < 4.0 * chance and chance < 0.1
    assert aimed.std() < 0.7 * plain.std()


@pytest.mark.thorough("10 km", "beside its middle")
@pytest.mark.parametrize(
    "half, at, middle",
    [
        (500.0, (0.0, 0.0), (0.0, 0.0)),
        (5000.0, (0.0, 0.0), (0.0, 0.0)),
        (500.0, (300.0, -250.0), (0.0, 0.0)),
        (500.0, (5300.0, -3000.0), (5000.0, -3100.0)),
    ],
    ids=["1 km", "10 km", "beside its middle", "far from the origin"],
)
def test_a_cube_above_a_plain(device: Device, half: float, at: Any, middle: Any) -> None:
    """By closed form: its walls see the plain in half of the directions by the cosine, and its
    floor in all; its shadow takes less than a hundredth."""
    with rendered(device, cube(half, at, middle), **SETTINGS) as renderer:
        found = falls(renderer)
    falls_on_plain = SUN.power[0] * -DOWN[2] * np.mean(GROUND.diffuse)
    exact = 3.0 * SIDE**2 * falls_on_plain
    assert found.mean() == pytest.approx(exact, rel=0.05)
    assert found.std() < 0.2 * exact


@pytest.mark.thorough("world-coated", "sun-coated")
@pytest.mark.parametrize("ground", [GROUND, COATED], ids=lambda ground: ground.name)
@pytest.mark.parametrize("light", [SUN, SKY], ids=lambda light: light.kind)
def test_boxes_on_a_plain(device: Device, ground: Material, light: Light) -> None:
    """Of a kilometre: what falls on them has no more noise than on ten metres."""
    noise = []
    for half in (5.0, 500.0):
        with rendered(device, boxes(half, light, ground=ground), **SETTINGS) as renderer:
            found = falls(renderer, passes=24)
        noise.append(found.std() / found.mean())
    assert noise[1] < noise[0]


def test_faces_change_no_light(
    device: Device, monkeypatch: pytest.MonkeyPatch, thorough: bool
) -> None:
    """What falls on things by a plain that is small enough to be met without a box's faces, too."""
    monkeypatch.setattr(surroundings, "LEAST_GAIN", 0.0)
    monkeypatch.setattr(aim, "is_small", lambda _: True)
    settings = SETTINGS | {"photons": 60_000}
    for ground in (GROUND, GLAZED, COATED) if thorough else (GLAZED,):
        with rendered(device, boxes(3.0, SUN, ground=ground), **settings) as renderer:
            tables = renderer.eye._tables
            assert len(tables.photon_portals)
            led = falls(renderer, passes=12)
            tables.set_photon_portals(NO_PORTALS)
            plain = falls(renderer, passes=12)
        chance = np.hypot(led.std(), plain.std()) / np.sqrt(11)
        assert led.mean() == pytest.approx(plain.mean(), abs=3.0 * chance)
        assert chance < 0.02 * plain.mean()


def test_the_box_is_the_scene_s_and_the_seed_s(device: Device) -> None:
    """Not the passes', the resolution's or a border's: ranges of passes merge to the bit."""

    def box(**settings: Any) -> bytes:
        with rendered(device, boxes(500.0, SUN), **SETTINGS | settings) as renderer:
            found: bytes = renderer.eye._tables.photon_portals.tobytes()
            return found

    whole = box()
    assert whole and box(seed=1) != whole
    for settings in ({"first_pass": 5}, {"width": 16, "region": (4, 2, 12, 6)}):
        assert box(**settings) == whole


@pytest.mark.thorough  # test_photon_portals.py compares the same programs
def test_no_layer_differs(device: Device) -> None:
    """By fragment and by compute programs photons land in the same places."""
    if not device.has_compute:
        pytest.skip("no compute programs")
    found = []
    for backend in ("fragment", "compute"):
        settings = SETTINGS | {"photons": 4000, "backend": backend}
        with rendered(device, boxes(500.0, SUN, SKY, ground=COATED), **settings) as renderer:
            assert len(renderer.eye._tables.photon_portals)
            found.append(fallen(renderer))
    np.testing.assert_allclose(*found, rtol=0.0 if device.is_software else 1e-6)


def test_where_little_is_about_there_are_none(device: Device) -> None:
    """And no other program is made."""
    with rendered(device, boxes(5.0, SUN), **SETTINGS, backend="fragment") as renderer:
        assert not len(renderer.eye._tables.photon_portals)
        mapper: Any = renderer.photons and renderer.photons.mapper
        assert len(mapper._bounce._reflectors.made()) == len(mapper._bounce._shades.made()) == 1
