# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons start where they count, and mean what they meant by flux."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.photons import aim
from addon.photon.photons.importance import Importance
from addon.photon.photons.mapper import PhotonBatch
from addon.photon.photons.starts import starts_by
from addon.photon.photons.view import View
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import (
    Light,
    Lobe,
    Material,
    Scene,
    area_light,
    point_light,
    spot_light,
    sun_light,
    world_light,
)
from addon.photon.settings import Settings
from addon.streams import Device
from tests.measure import rendered
from tests.scenes import DIM, Builder, camera, plain_material
from tests.stability.table import Measured

pytestmark = pytest.mark.usefixtures("soon")
WALL = plain_material("wall", (0.6, 0.5, 0.4))
SETTINGS: dict[str, Any] = {"width": 32, "height": 32, "photons": 20000, "passes": 8}
CANDLE = point_light("candle", (-0.3, 0.2, 0.5), (20.0,) * 3)
SUN = point_light("sun", (5.0, 5.0, 20.0), (1e6,) * 3)
CEILING = area_light("ceiling", (0.0, 0.0, 4.0), (400.0,) * 3, size=(16.0, 16.0))
HUGE = area_light("huge", (0.0, 0.0, 100.0), (2e5,) * 3, size=(400.0, 400.0))
FAR_SPOT = spot_light(
    "far spot", (30.0, -30.0, 100.0), (4e5,) * 3, (-0.3, 0.3, -1.0), size=1.5, blend=0.2
)
LAMP = point_light("lamp", (0.5, -0.3, 0.4), (10.0,) * 3)


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single light is asked for before pass 1, as several are."""
    monkeypatch.setattr(aim, "PASSES_OF_ONE", 1)


def room(*lights: Any, emissive: Material = WALL) -> Scene:
    """A closed one, on a plain; something in it may be emissive."""
    built = Builder().box((-1, -1, -1), (1, 1, 1), 0, "room")
    low, high = -20, 20
    z = -1.01
    built.quad((low, low, z), (high, low, z), (high, high, z), (low, high, z), 0, "plain")
    built.box((0.1, -0.3, -1), (0.4, 0.3, 0.2), 1, "box")
    return built.scene(camera((-0.9, -0.9, 0.8), (0.3, 0.3, -0.4), 80), lights, [WALL, emissive])


def chosen(device: Device, scene: Scene, **settings: Any) -> NDArray[Any]:
    """With which probability photons start at each light."""
    with rendered(device, scene, **(SETTINGS | {"passes": 2} | settings)) as renderer:
        found: NDArray[Any] = renderer.eye._tables.lights["chosen"].copy()
        return found


@pytest.mark.parametrize("backend", ["native", "fragment"])
def test_a_candle_beside_the_sun(device: Device, backend: str) -> None:
    """Gets its photons, and so its room the light that it has without a sun, which shines on its
    roof."""
    by_flux = CANDLE.power[0] / (CANDLE.power[0] + SUN.power[0])
    share = chosen(device, room(CANDLE, SUN), backend=backend)[0]
    assert share > 0.4 > 1e4 * by_flux
    alone, both = (
        np.mean(
            [
                images_of(device, scene, backend=backend, seed=seed)["Indirect"].mean(axis=(0, 1))
                for seed in range(3)
            ],
            axis=0,
        )
        for scene in (room(CANDLE), room(CANDLE, SUN))
    )
    np.testing.assert_allclose(both, alone, rtol=0.02)


def test_a_lamp_that_no_picture_shows(device: Device) -> None:
    """Its photons land elsewhere, and where little is known all lamps are aimed: not that one."""
    built = Builder().quad((-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0), 0, "floor")
    built.box((-0.1, -0.1, 0.01), (0.1, 0.1, 0.2), 0, "block")
    built.box((-1, -1, -13), (1, 1, -11), 0, "cellar")
    hidden = point_light("hidden", (0.0, 0.0, -12.0), (20.0,) * 3)
    scene = built.scene(camera((0, -3, 3), (0, 0, 0), 60), [CANDLE, hidden], [WALL])
    both, alone = (
        images_of(device, x)["Combined"].mean(axis=(0, 1))
        for x in (scene, replace(scene, lights=(CANDLE,)))
    )
    np.testing.assert_allclose(both, alone, rtol=0.02)


def test_photons_that_say_nothing_start_by_flux(device: Device) -> None:
    """All landed where nobody looks: of half of few photons that may be."""
    renderer = prepare(room(CANDLE, LAMP), Settings(8, 8, photons=100), device)
    renderer.render_pass()
    tables = renderer.eye._tables
    none = np.zeros((4, 6))
    known = Importance(np.arange(4) % 2, none[:, :4].astype(np.float32), none, none[:, 0], 0.5)
    nothing = View(0.1, None, none[:0, :3], none[:0, :3], none[:0, 0])
    shares = starts_by(known, tables, nothing).shares
    assert shares == pytest.approx(tables.by_flux)
    renderer.release()


def images_of(device: Device, scene: Scene, **settings: Any) -> dict[str, Any]:
    with rendered(device, scene, **(SETTINGS | settings)) as renderer:
        return renderer.images()


def test_lights_alike_get_photons_by_flux(device: Device) -> None:
    """Whatever the view, and so photons serve the next one."""
    assert chosen(device, room(CANDLE, LAMP)) == pytest.approx([2 / 3, 1 / 3], rel=1e-6)


def test_any_shares_mean_the_same(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is asked of lamps and of what is emissive, however many photons each gets."""
    emissive = Material("emissive", (0.2,) * 3, (), (0.5, 1.0, 2.0))
    scene, found = room(CANDLE, LAMP, emissive=emissive), []
    monkeypatch.setattr(aim, "PROMISING", np.inf)
    for gain in (0.0, np.inf):
        monkeypatch.setattr(aim, "LEAST_GAIN_OF_SHARES", gain)
        found.append((chosen(device, scene), images_of(device, scene)["Indirect"]))
    assert np.abs(found[0][0] - found[1][0]).max() > 0.01
    assert all(share.min() > 0 and share.sum() == pytest.approx(1) for share, _ in found)
    means = [image.mean(axis=(0, 1)) for _, image in found]
    np.testing.assert_allclose(*means, rtol=0.02)


def test_shares_are_the_scene_s(device: Device) -> None:
    """Not the passes', the resolution's or a border's: ranges of passes merge to the bit."""
    scene = room(CANDLE, SUN)
    first = chosen(device, scene)
    for settings in ({"first_pass": 5}, {"width": 16, "height": 24}, {"region": (8, 8, 24, 16)}):
        np.testing.assert_array_equal(chosen(device, scene, **settings), first)


def test_a_first_picture_waits_for_nothing(device: Device) -> None:
    """Where lights are near and alike its photons go by flux; the next ones by what is learned."""
    settings = Settings(8, 8, photons=100, backend="fragment")
    renderer = prepare(room(CANDLE, LAMP), settings, device)
    renderer.render_pass()
    assert renderer.launches()["generator"] == 1
    renderer.render_pass()
    assert renderer.launches()["generator"] == 3
    renderer.release()


def starts(device: Device, scene: Scene, **settings: Any) -> bytes:
    """How photons start."""
    with rendered(device, scene, **(SETTINGS | {"passes": 2} | settings)) as renderer:
        made: bytes = renderer.eye._tables.starts()
        return made


def aims(device: Device, scene: Scene, **settings: Any) -> set[int]:
    """The lights of which some are aimed."""
    with rendered(device, scene, **(SETTINGS | {"passes": 2} | settings)) as renderer:
        found = renderer.eye._tables.aims
        return set(found.by_light) if found else set()


def test_even_light_is_not_aimed(device: Device) -> None:
    assert not aims(device, room(CANDLE))


SKY = world_light("sky", (1.0, 1.5, 2.0))
BEAM = sun_light("sun", (9.0, 8.0, 7.0), (0.6, -0.9, -0.9), 0.05)
PANEL = area_light("panel", (0, -2.5, 1.5), (400.0,) * 3, (0, 1.0, -1.0), size=(0.4, 0.3))
BULB = point_light("bulb", (0.3, -2.5, 1.2), (100.0,) * 3, 0.1)
CONE = spot_light("cone", (0.3, -2.5, 1.2), (100.0,) * 3, (0, 1, -0.4), size=2.5, blend=0.3)


def behind_a_window(light: Light, half: float = 1.0, view: float = 1.0) -> Scene:
    """A room on a plain, in one wall of which there is a small hole; `half` its size, and `view`
    which side the picture shows."""
    built = Builder()
    built.box((-6, -6, -1.3), (6, 6, -1.2), 1)
    built.box((-1, 1, -1), (1, 1.1, 1), 0)
    for x in (-1.1, 1.0):
        built.box((x, -1, -1), (x + 0.1, 1, 1), 0)
    for z in (-1.1, 1.0):
        built.box((-1.1, -1.1, z), (1.1, 1.1, z + 0.1), 0)
    hole = 0.2 * half
    built.box((-1, -1.1, -1), (-hole, -1, 1), 0)
    built.box((hole, -1.1, -1), (1, -1, 1), 0)
    built.box((-hole, -1.1, hole), (hole, -1, 1), 0)
    built.box((-hole, -1.1, -1), (hole, -1, -hole), 0)
    return built.scene(camera((0.0, -0.9, 0.3), (0.3 * view, 0.5, -0.3), 90), (light,), [WALL, DIM])


def fallen_in(renderer: Renderer, room: bool = True, passes: int = 6) -> NDArray[Any]:
    """The flux [W] that photons bring into the room, or elsewhere, and the sum of its squares, by
    passes."""
    assert renderer.photons
    mapper, frame, found = renderer.photons.mapper, renderer.frame, []
    for index in range(passes):
        mapper.start(PhotonBatch(100 + index, 100000))
        place, deposit = mapper.finish().arrays()
        far = np.abs(place[:, :3] * frame.scale + frame.centre).max(axis=1)
        there = (far < 1.05) == room
        flux = deposit[there, :3].mean(axis=1).astype(float) * frame.scale**2
        found.append([flux.sum(), (flux**2).sum()])
    return np.array(found)


@pytest.mark.parametrize("light", [SKY, BEAM, PANEL, BULB, CONE], ids=lambda light: light.kind)
def test_light_through_a_hole(device: Device, light: Light) -> None:
    """Is aimed at it, whatever the light, and brings what it brings otherwise, by more photons."""
    settings = SETTINGS | {"passes": 2, "seed": 3}
    with rendered(device, behind_a_window(light), **settings) as renderer:
        tables = renderer.eye._tables
        assert tables.aims
        aimed = fallen_in(renderer)
        tables.aim(None)
        plain = fallen_in(renderer)
    off = aimed[:, 0].mean() - plain[:, 0].mean()
    chance = np.sqrt((aimed[:, 0].var(ddof=1) + plain[:, 0].var(ddof=1)) / len(plain))
    assert abs(off) < 4.0 * chance and chance < 0.3 * plain[:, 0].mean()
    assert aimed[:, 1].mean() < plain[:, 1].mean() / 2.0


@pytest.mark.parametrize("light", [SKY, BULB], ids=lambda light: light.kind)
def test_what_no_picture_shows_is_lit(device: Device, light: Light) -> None:
    """Photons that are aimed at a hole bring the plain all its light: some start anywhere."""
    settings = SETTINGS | {"passes": 2, "direct_by_photons": True}
    with rendered(device, behind_a_window(light), **settings) as renderer:
        tables = renderer.eye._tables
        assert tables.aims
        aimed = fallen_in(renderer, room=False, passes=4)
        tables.aim(None)
        plain = fallen_in(renderer, room=False, passes=4)
    assert aimed[:, 0].mean() == pytest.approx(plain[:, 0].mean(), rel=0.02)
    assert aimed[:, 1].mean() < 10.0 * plain[:, 1].mean()


def test_ranges_of_passes_merge(device: Device) -> None:
    """To the bit: who begins later aims alike."""
    scene = behind_a_window(SKY)
    whole = starts(device, scene)
    assert len(whole) > 500
    for settings in ({"first_pass": 5}, {"width": 16, "height": 24}, {"region": (8, 8, 24, 16)}):
        assert starts(device, scene, **settings) == whole


@pytest.mark.parametrize("light", [SKY, BULB], ids=lambda light: light.kind)
def test_passes_are_independent(device: Device, light: Light) -> None:
    """One after the other they give what each gives alone, by the same starts and radii."""
    scene = behind_a_window(light)
    settings = {"width": 16, "height": 16, "boundary_correction": False}
    alone = [images_of(device, scene, first_pass=i, passes=1, **settings) for i in (1, 2)]
    both = images_of(device, scene, first_pass=1, passes=2, **settings)["Indirect"]
    mean = (alone[0]["Indirect"] + alone[1]["Indirect"]) / 2
    assert both.any()
    np.testing.assert_allclose(both, mean, rtol=1e-5, atol=1e-9)


@pytest.mark.thorough("fragment")
@pytest.mark.parametrize("backend", ["fragment", "compute"])
def test_all_ways_aim_alike(device: Device, backend: str) -> None:
    """To rounding, by which a photon may go another way, and tell others another one."""
    if backend == "compute" and not device.has_compute:
        pytest.skip("no compute programs")
    for scene in (behind_a_window(SKY), behind_a_window(BULB)):
        settings = {"radius": 0.4, "photons": 20000, "passes": 2, "width": 16, "height": 16}
        means = np.array(
            [
                [
                    images_of(device, scene, backend=own, seed=seed, **settings)["Indirect"].mean()
                    for seed in range(1, 6)
                ]
                for own in ("native", backend)
            ]
        )
        assert np.median(np.abs(means[0] / means[1] - 1.0)) < 1e-3
        assert means[0].mean() == pytest.approx(means[1].mean(), rel=0.02)


def tray(half: float) -> Scene:
    """A tray with rims that hide the plain about it, as wide as twice `half`, from what is in it;
    under the sun."""
    built = Builder().box((-half, -half, -0.2), (half, half, 0.0), 0, "plain")
    built.box((-0.5, -0.5, 0.6), (0.5, 0.5, 0.7), 0, "table")
    for at, other in (((0.46, -0.5), (0.5, 0.5)), ((-0.5, -0.5), (-0.46, 0.5))):
        built.box((*at, 0.7), (*other, 1.0), 0)
    for at, other in (((-0.46, 0.46), (0.46, 0.5)), ((-0.46, -0.5), (0.46, -0.46))):
        built.box((*at, 0.7), (*other, 1.0), 0)
    eye = camera((0.2, -0.3, 1.8), (0.0, 0.05, 0.7), 26)
    return built.scene(eye, (sun_light("sun", (3.0,) * 3, (0.3, 0.5, -0.8), 0.01),), [WALL])


@pytest.mark.thorough
@pytest.mark.stability(60)
def test_sun_over_a_plain(device: Device) -> None:
    """Of a kilometre: a lit tray on it has at most twice the error of one on ten metres."""
    settings = {"width": 16, "height": 16, "photons": 15000, "radius": 0.1, "passes": 4}
    near, far = (
        np.array(
            [images_of(device, tray(half), **settings, seed=seed)["Indirect"] for seed in range(8)]
        )
        for half in (5.0, 500.0)
    )
    truth = near.mean(axis=0)
    assert far.mean() == pytest.approx(near.mean(), rel=0.03)
    errors = [((found - truth) ** 2 / truth.mean() ** 2).mean() for found in (near, far)]
    assert errors[1] < 2.0 * errors[0] * 8 / 7  # the truth is the near one's mean


def ball_on_a_plain(half: float) -> Scene:
    """Of glass, 0.1 m wide, under the sun; the plain is as wide as twice `half`."""
    built = Builder().quad((-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0))
    built.sphere((0, 0, 0.06), 0.05, subdivisions=3, material=1)
    eye = camera((0.1, -0.25, 0.3), (0.0, 0.03, 0.03), 30)
    sun = sun_light("sun", (3.0,) * 3, (0.3, 0.5, -0.8), 0.01)
    parameters = {"ior": 1.5, "tint": (1.0,) * 3, "reflects": 2.0, "open": 0.0}
    glass = Material("glass", (0.0,) * 3, (Lobe("glass", (1.0,) * 3, parameters),))
    return built.scene(eye, (sun,), [WALL, glass])


@pytest.mark.stability(60)
def test_a_caustic_on_a_plain(device: Device, measured: Measured) -> None:
    """Of a kilometre has at most twice the squared error of one on ten metres, in a picture of most
    seeds. In some a single photon from far off brings as much as all others: their variance is
    between a tenth and ten times, by the seeds."""
    settings = {"width": 16, "height": 16, "photons": 20000, "radius": 0.01, "passes": 2}
    near, far = (
        np.array(
            [
                images_of(device, ball_on_a_plain(half), **settings, seed=seed)["Indirect"]
                for seed in range(8)
            ]
        )
        for half in (5.0, 500.0)
    )
    means = [np.median(images.mean(axis=(1, 2, 3))) for images in (near, far)]
    assert means[1] == pytest.approx(means[0], rel=0.15)
    truth = np.median(near, axis=0)
    errors = [np.median(((x - truth) ** 2).mean(axis=(1, 2, 3))) for x in (near, far)]
    assert measured("squared error of 1 km over 10 m", errors[1] / errors[0]) < 2.0
    assert truth.max() > 5.0 * np.median(truth)  # a caustic


@pytest.mark.thorough("huge")
@pytest.mark.parametrize("light", [CEILING, HUGE, FAR_SPOT], ids=lambda light: light.name)
def test_light_that_seldom_lands(device: Device, light: Light) -> None:
    """Things on a floor in the open, under a lamp much larger than they are, or far from them: of a
    hundred photons less than one bounces off the floor to them. Few a pass, or many at once."""
    built = Builder().quad((-8, -8, 0), (8, -8, 0), (8, 8, 0), (-8, 8, 0), 0, "floor")
    built.box((0.7, -0.3, 0.3), (1.3, 0.3, 0.9), 0, "box").sphere((-0.8, -0.5, 0.6), 0.6, 0, "ball")
    scene = built.scene(camera((0.5, -7, 3), (0, 0, 0.5), 35), [light], [WALL])
    found = []
    for passes, photons in ((32, 13824), (2, 500_000)):
        settings = {"width": 96, "height": 72, "passes": passes, "photons": photons, "seed": 1}
        with rendered(device, scene, **settings) as renderer:
            found.append(renderer.images(["Indirect"])["Indirect"].mean(dtype=float))
    assert found[0] == pytest.approx(found[1], rel=0.2)


@pytest.mark.thorough("compute", "no world")
@pytest.mark.parametrize("hidden", [False, True], ids=["no world", "a world that it hides"])
@pytest.mark.parametrize("backend", ["native", "compute"])
def test_a_dome_far_away(device: Device, backend: str, hidden: bool) -> None:
    """Things on a floor in a dome of emitting triangles are lit as by a world of its radiance; of
    the photons that leave it by the cosine none comes there."""
    found = []
    for radius, seeds in ((0.0, (0,)), (60.0, (0, 3, 4))):  # of which two had a third of the light
        built = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), 0, "floor")
        built.box((0.7, -0.3, 0.3), (1.3, 0.3, 0.9), 0, "box")
        built.sphere((-0.8, -0.5, 0.6), 0.6, 0, "ball")
        if radius:
            built.sphere((0, 0, 0), radius, 1, "dome", subdivisions=3)
        world = [world_light("world", (0.01 if radius else 1.0,) * 3)]
        lights = world if hidden or not radius else []
        dome = Material("dome", (0.0, 0.0, 0.0), emission=(1.0,) * 3)
        scene = built.scene(camera((0.5, -7, 3), (0, 0, 0.5), 30), lights, [WALL, dome])
        settings = {"width": 64, "height": 48, "passes": 16, "photons": 30000, "backend": backend}
        for seed in seeds:
            with rendered(device, scene, **settings, seed=seed) as renderer:
                images = renderer.images(["Indirect"])
            found.append(images["Indirect"].mean(axis=(0, 1), dtype=float))
    for of_dome in found[1:]:
        assert of_dome == pytest.approx(found[0], rel=0.1)
    assert (found[0] > 0.001).all()
